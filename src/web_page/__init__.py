"""A page in the browser, served by viser to whoever may see it; knows nothing of what it shows."""
