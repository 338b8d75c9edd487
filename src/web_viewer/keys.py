"""Keys that are held, and gamepads, for a page's hotkeys: a browser repeats one key, and that late."""

PERIOD = 100  # [ms] between two events of a held key
STOP = "k"  # pressed once all have been let go
DRIVE = "ijlmuo"
# A page's program that hears keydown events hears these, too. A stick that is pushed is a key that is held:
# the left one ahead, back and turning, the right one to the sides.
SCRIPT = f"""
<script>
(() => {{
  const held = new Set(); let driven = false;
  const press = key => document.documentElement.dispatchEvent(new KeyboardEvent("keydown",
    {{key, code: "Key" + key.toUpperCase(), bubbles: true}}));
  const typing = at => /^(INPUT|TEXTAREA|SELECT)$/.test(at?.tagName || "");
  addEventListener("keydown", event => {{
    const plain = !(event.ctrlKey || event.metaKey || event.altKey || event.shiftKey);
    if (event.isTrusted && plain && !typing(event.target) && "{DRIVE}".includes(event.key))
      held.add(event.key);
  }});
  addEventListener("keyup", event => held.delete(event.key.toLowerCase()));
  for (const gone of ["blur", "pagehide", "visibilitychange"])
    addEventListener(gone, () => held.clear(), true);
  setInterval(() => {{
    const keys = new Set(held);
    for (const pad of document.hasFocus() ? navigator.getGamepads() : []) {{
      const [left = 0, ahead = 0, aside = 0] = pad?.axes || [];
      for (const [key, pushed] of [["i", -ahead], ["m", ahead], ["j", -left], ["l", left],
                                   ["u", -aside], ["o", aside]])
        if (pushed > 0.5) keys.add(key);
    }}
    keys.forEach(press);
    if (driven && !keys.size) press("{STOP}");
    driven = keys.size > 0;
  }}, {PERIOD});
}})();
</script>
""".encode()
