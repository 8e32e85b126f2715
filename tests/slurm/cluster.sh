# shellcheck shell=bash
# A Slurm cluster of one node on this machine, for a test; sourced. Needs slurm-wlm and munge, and root. Everything lies in
# $cluster, a new folder; stop_cluster ends the daemons and removes it. No other cluster is touched: ports, sockets and key
# are its own.

start_cluster() {
  cluster=$(mktemp -d)
  chmod 755 "$cluster"
  mkdir "$cluster/munge" "$cluster/state" "$cluster/spool"
  head -c 1024 /dev/urandom >"$cluster/munge/key"
  chmod 400 "$cluster/munge/key"
  chown -R munge:munge "$cluster/munge"
  setpriv --reuid=munge --regid=munge --clear-groups munged --foreground --force --key-file="$cluster/munge/key" \
    --socket="$cluster/munge/socket" --pid-file="$cluster/munge/pid" --log-file="$cluster/munge/log" \
    --seed-file="$cluster/munge/seed" >"$cluster/munged.out" 2>&1 &
  daemons=($!)
  local port=$((20000 + RANDOM % 20000))
  cat >"$cluster/slurm.conf" <<EOF
ClusterName=test
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$cluster/munge/socket
CryptoType=crypto/munge
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/slurmd.pid
SlurmctldLogFile=$cluster/slurmctld.log
SlurmdLogFile=$cluster/slurmd.log
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1,bf_interval=1
KillWait=2
NodeName=localhost NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(awk '/MemTotal/ { print int($2 / 1024 * 0.9) }' /proc/meminfo)
PartitionName=main Nodes=localhost Default=YES MaxTime=INFINITE State=UP
EOF
  export SLURM_CONF=$cluster/slurm.conf
  trap stop_cluster EXIT
  local i
  for ((i = 0; i < 100; ++i)); do
    [[ ! -S $cluster/munge/socket ]] || break
    sleep 0.1
  done
  slurmctld -D -c >"$cluster/slurmctld.out" 2>&1 &
  daemons+=($!)
  slurmd -D -N localhost >"$cluster/slurmd.out" 2>&1 &
  daemons+=($!)
  for ((i = 0; i < 300; ++i)); do
    [[ $(sinfo -h -o %t 2>/dev/null) == idle ]] && return
    sleep 0.1
  done
  echo 'tests/slurm: the cluster does not come up' >&2
  tail -n 20 "$cluster"/*.log "$cluster"/*.out "$cluster/munge/log" >&2
  return 1
}

stop_cluster() {
  local status=$?
  scancel --quiet --user=root 2>/dev/null || true
  kill "${daemons[@]}" 2>/dev/null || true
  wait "${daemons[@]}" 2>/dev/null || true
  rm -rf "$cluster"
  return $status
}
