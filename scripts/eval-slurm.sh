#!/usr/bin/env bash
# A suite as a Slurm job array, a part each: sbatch --array=1-8 scripts/eval-slurm.sh SUITE OUT [donut eval's flags ..]
# Submitting the same again goes on where parts were killed. Afterwards: donut eval merge OUT/part-* --out OUT/all
#SBATCH --job-name=donut-eval
#SBATCH --cpus-per-task=2
set -euo pipefail
suite=$1 out=$2
shift 2
part=$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT
exec "${DONUT:-donut}" eval --suite "$suite" --shard "$part" --threads "${SLURM_CPUS_PER_TASK:-1}" \
    --out "$out/part-$SLURM_ARRAY_TASK_ID" --resume "$@"
