"""Keys that are held, and gamepads, for a page's hotkeys: a browser repeats one key, and that late."""

PERIOD = 100  # [ms] between two events of a held key
STOP = "k"  # pressed once all have been let go
PAIRS = ("im", "jl", "uo", "yh", "tg", "bn")  # opposite ways, by keys that viser leaves free
# A page's program that hears keydown events hears these, too. A stick that is pushed, or a button, is a key
# that is held: the left stick the first two pairs, the right one the next two, the buttons the others.
SCRIPT = f"""
<script>
(() => {{
  const held = new Set(), pairs = {list(PAIRS)}; let driven = false;
  const press = key => document.documentElement.dispatchEvent(new KeyboardEvent("keydown",
    {{key, code: "Key" + key.toUpperCase(), bubbles: true}}));
  const typing = at => /^(INPUT|TEXTAREA|SELECT)$/.test(at?.tagName || "");
  addEventListener("keydown", event => {{
    const plain = !(event.ctrlKey || event.metaKey || event.altKey || event.shiftKey);
    if (event.isTrusted && plain && !typing(event.target) && "{"".join(PAIRS)}".includes(event.key))
      held.add(event.key);
  }});
  addEventListener("keyup", event => held.delete(event.key.toLowerCase()));
  for (const gone of ["blur", "pagehide", "visibilitychange"])
    addEventListener(gone, () => held.clear(), true);
  setInterval(() => {{
    const keys = new Set(held);
    for (const pad of document.hasFocus() ? navigator.getGamepads() : []) {{
      const [left = 0, ahead = 0, aside = 0, up = 0] = pad?.axes || [];
      [ahead, left, aside, up].forEach((way, pair) => {{
        if (Math.abs(way) > 0.5) keys.add(pairs[pair][way < 0 ? 0 : 1]);
      }});
      (pad?.buttons || []).slice(0, 4).forEach((button, number) => {{
        if (button.pressed) keys.add((pairs[4] + pairs[5])[number]);
      }});
    }}
    keys.forEach(press);
    if (driven && !keys.size) press("{STOP}");
    driven = keys.size > 0;
  }}, {PERIOD});
}})();
</script>
""".encode()
