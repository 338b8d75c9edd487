#!/usr/bin/env bash
# What the Containerfile runs as root, in the image: makes the workspace ready for a user without rights.
set -euo pipefail
CHECKOUT=$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")

useradd --create-home --shell /bin/bash cartpole
PIP_NO_CACHE_DIR=1 "$CHECKOUT/ws" true
# Compilers for packages that are mounted into a container.
sed '/^#/d' "$CHECKOUT/requirements/compiler.txt" | xargs apt-get install --yes --no-install-recommends tini
apt-get clean
rm -rf /var/lib/apt/lists/*
chown --recursive cartpole: "$CHECKOUT"
