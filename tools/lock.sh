#!/usr/bin/env bash
# Resolves requirements/*.txt once for each Python that ws supports: tools/lock.sh [--upgrade], with uv on PATH.
#
# The files are constraints for pip: of all that is installed, they pin what the lists don't name. Torch isn't
# among them, since it may be Debian's; nor is what only a CUDA build of it needs, of any use elsewhere.
# Versions stay what they were as long as they fit, unless --upgrade says otherwise.
set -euo pipefail
cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")/../requirements"

for version in 3.11 3.12 3.13; do
    lock=lock-$version.txt
    uv pip compile --quiet --python-version "$version" --no-annotate --no-header --no-emit-package torch \
        --output-file "$lock" "$@" base.txt test.txt extras.txt docs.txt >/dev/null
    { echo "# Constraints for Python $version; tools/lock.sh writes them."; sed -E '/^(cuda|nvidia|triton)[-=]/d' "$lock"; } >"$lock.new"
    mv -- "$lock.new" "$lock"
done
