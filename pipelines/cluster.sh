#!/usr/bin/env bash
# An experiment on a cluster with Slurm: an array job tracks its recordings, a share in each task; when all tasks have ended, one
# more job evaluates. Recordings and results lie on a file system that all nodes see. What was tracked stays tracked, so the script
# may be started again after a failure.
#
#   pipelines/cluster.sh EXPERIMENT.toml OUT [N_SHARES] [SBATCH OPTIONS...]
#
# N_SHARES is 8 when left out; options such as --partition=compute or --time=30 go to every job. A cluster of another kind
# needs the same two commands: `chainwave run EXPERIMENT --out OUT --share K/N` for K from 1 to N, and then the same without --share.
set -euo pipefail

if [ $# -lt 2 ]; then
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" >&2
  exit 2
fi
experiment=$1 out=$2 n_shares=8
shift 2
if [[ ${1:-} =~ ^[0-9]+$ ]]; then
  n_shares=$1
  shift
fi

printf -v run 'chainwave run %q --out %q --jobs ${SLURM_CPUS_PER_TASK:-1}' "$experiment" "$out"
tracking=$(sbatch --parsable --job-name=chainwave-track --array="1-$n_shares" "$@" \
  --wrap "$run --share \$SLURM_ARRAY_TASK_ID/$n_shares")
# A share with a recording that cannot be read ends with exit code 1; the others are evaluated all the same.
evaluation=$(sbatch --parsable --job-name=chainwave-evaluate --dependency="afterany:${tracking%%;*}" "$@" --wrap "$run")
echo "tracking: job $tracking, $n_shares tasks; evaluation: job $evaluation, into $out"
