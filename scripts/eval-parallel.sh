#!/usr/bin/env bash
# A suite in N parts with GNU parallel, as many at once as there are cores: scripts/eval-parallel.sh N SUITE OUT [donut eval's flags ..]
# On several machines: PARALLEL="--sshloginfile hosts --workdir ." (OUT on a disk that all see, donut on each).
# Running the same again goes on where parts were killed; the parts are joined in OUT/all.
set -euo pipefail
parts=$1 suite=$2 out=$3
shift 3
donut=${DONUT:-donut}
seq "$parts" | parallel --halt soon,fail=1 --line-buffer --tagstring 'part {}' \
    "$donut" eval --suite "$suite" --shard "{}/$parts" --threads 1 --out "$out/part-{}" --resume "$@" > /dev/null
rm -rf -- "$out/all"
"$donut" eval merge "$out"/part-* --out "$out/all"
