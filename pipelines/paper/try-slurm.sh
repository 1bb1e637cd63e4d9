#!/usr/bin/env bash
# The workflow on Slurm's own daemons: starts munged, slurmctld and slurmd on this machine in a folder of their own, tracks an experiment
# in shares as jobs of the cluster, kills one midway, sees that the workflow ends all the same, and takes the daemons down.
#
#   pipelines/paper/try-slurm.sh EXPERIMENT OUT
#
# EXPERIMENT is an experiment.toml with its recordings. Needs root, `snakemake` with its executor plugin for Slurm in the path, and the
# daemons from the system's packages: apt-get install slurmctld slurmd slurm-client munge. The command is `chainwave`, or what
# CHAINWAVE_COMMAND names.
set -euo pipefail

if [ $# != 2 ]; then
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" >&2
  exit 2
fi
for program in munged slurmctld slurmd sbatch squeue scancel snakemake; do
  command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 0; }
done
# Jobs look for the configuration where the packages have it: one that is there belongs to a real cluster.
conf=/etc/slurm/slurm.conf
[ ! -e "$conf" ] || { echo "skipped: this machine belongs to a cluster ($conf)"; exit 0; }
[ "$(id -u)" = 0 ] || { echo 'skipped: the daemons need root'; exit 0; }

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
experiment=$(realpath "$1") out=$(realpath -m "$2")
chainwave=${CHAINWAVE_COMMAND:-chainwave}
dir=$(mktemp -d) host=$(hostname -s) pids=()
mkdir -p "$dir/state" "$dir/spool" "$dir/log" "$out"

down() {
  timeout 10 scancel --user="$(id -un)" 2>/dev/null || true
  local pid
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null || true; done
  rm -rf "$dir" "$conf"
}
trap down EXIT

# Munge refuses folders that others may write to.
chmod 0755 "$dir"
dd if=/dev/urandom of="$dir/key" bs=1024 count=1 status=none
chmod 0400 "$dir/key"
munged --foreground --force --key-file="$dir/key" --socket="$dir/munge.socket" --pid-file="$dir/munged.pid" \
  --seed-file="$dir/seed" > "$dir/log/munged" 2>&1 &
pids+=($!)

mkdir -p "${conf%/*}"
cat > "$conf" <<CONF
ClusterName=trial
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$dir/munge.socket
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MinJobAge=600
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=1000 State=UNKNOWN
PartitionName=trial Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
slurmctld -D -c > "$dir/log/slurmctld" 2>&1 &
pids+=($!)
slurmd -D -N "$host" > "$dir/log/slurmd" 2>&1 &
pids+=($!)
for ((i = 0; i < 30; i++)); do
  sinfo --noheader --states=idle --format=%t 2>/dev/null | grep -q idle && break
  sleep 1
done
if ! sinfo --noheader --states=idle --format=%t 2>/dev/null | grep -q idle; then
  echo 'failed: the node did not come up' >&2
  tail -n 20 "$dir"/log/* >&2
  exit 1
fi
echo "slurm $(sinfo --version | cut -d' ' -f2): the node is up"

start=$SECONDS
snakemake --snakefile "$here/workflow/Snakefile" --workflow-profile "$here/profiles/slurm" --directory "$out" \
  --config out="$out" experiment="$experiment" shares=4 threads=1 command="$chainwave" \
  --default-resources slurm_partition=trial slurm_account=nobody mem_mb=100 runtime=30 --slurm-status-command squeue \
  --seconds-between-status-checks 5 --latency-wait 10 results > "$out/snakemake.log" 2>&1 &
workflow=$!

# The first job that runs is killed, as by a node that fails.
killed=
while [ -z "$killed" ] && kill -0 "$workflow" 2>/dev/null; do
  job=$(squeue --noheader --states=RUNNING --format=%i | head -n 1)
  if [ -n "$job" ] && scancel --signal=KILL --full "$job" 2>/dev/null; then killed=$job; fi
  sleep 0.2
done
code=0
wait "$workflow" || code=$?
if [ "$code" != 0 ] || [ -z "$killed" ] || [ ! -e "$out/results/report.html" ]; then
  echo "failed: exit code $code, job killed: ${killed:-none}" >&2
  tail -n 40 "$out/snakemake.log" >&2
  tail -n 20 "$dir"/log/slurm* >&2
  exit 1
fi
echo "the workflow ended in $((SECONDS - start)) s although job $killed was killed; $(grep -c 'SLURM jobid' "$out/snakemake.log" || true) submissions"
