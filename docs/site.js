// The site's search takes a word after a dash as one to leave out, and one before a colon as a field's name.
// An option's own entry has underscores.
const post = Worker.prototype.postMessage;
Worker.prototype.postMessage = function (message, ...rest) {
  const option = (_, blank, name) => `${blank}${name} ${name.replaceAll("-", "_")}`;
  if (typeof message?.data === "string")
    message = { ...message, data: message.data.replaceAll(":", " ").replace(/(^|\s)-+([\w-]+)/g, option) };
  return post.call(this, message, ...rest);
};

// A picture that is shown smaller than it is opens in its own size.
for (const picture of document.querySelectorAll("article img")) {
  picture.addEventListener("click", () => open(picture.src));
  picture.style.cursor = "zoom-in";
}
