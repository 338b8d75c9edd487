#!/usr/bin/env python3
"""Takes a picture of a web page with headless Chromium (apt-get install chromium).

./ws env PYTHONPATH=test python3 test/support/pages/screenshot.py http://127.0.0.1:8080/ out.png --click World
"""

import argparse
import io
import time
from pathlib import Path

from PIL import Image
from support.pages.browser import Browser, wait_for

NOTICE = ".mantine-Notification-closeButton"  # as that WebGL is drawn in software here
COLOURS = 256


def parse_args():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("address")
    parser.add_argument("out", type=Path, help="a PNG, of 256 colours")
    parser.add_argument("--click", nargs="*", default=[], metavar="TEXT", help="in this order")
    parser.add_argument("--size", default="1200x700", help="of the picture [pixels]")
    parser.add_argument(
        "--settle", type=float, default=10.0, help="[s] from then on until the picture is taken"
    )
    return parser.parse_args()


def main():
    args = parse_args()
    size = tuple(int(each) for each in args.size.split("x"))
    with Browser(args.address) as page:
        page.resize(*size)
        for text in args.click:
            page.click(text)
        wait_for(lambda: bool(page.text.strip()), "text on the page")
        time.sleep(args.settle)
        page.run(f"document.querySelectorAll('{NOTICE}').forEach(e => e.click())")
        time.sleep(args.settle / 5.0)
        picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(args.out, optimize=True)
    print(f"{args.out}: {args.out.stat().st_size} bytes, {picture.width} x {picture.height}")


if __name__ == "__main__":
    main()
