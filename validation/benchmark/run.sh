#!/usr/bin/env bash
# lpv, CSDP, SDPA and Clarabel on the same problems. Installs what it needs, on Debian as root.
set -euo pipefail
cd "$(dirname "$0")"
if ! { command -v csdp && command -v sdpa && dpkg -s libopenblas-dev; } >/dev/null 2>&1; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends coinor-csdp sdpa libopenblas-dev gfortran pkg-config >/dev/null
fi
(cd ../.. && cargo build --release --locked && cargo build --release --locked -p lmi --example saturated_regulator)
cargo run --release --locked -- "$@"
