#!/usr/bin/env bash
# Four ranks on four hosts: network namespaces with host names of their own, joined by a switch that
# delays each frame by 1 ms. The measured round trips prove that nothing went through shared memory.
#   four_hosts.sh BUILD_FOLDER SCENARIO_FOLDER       exit code 77: cannot run here
set -euo pipefail
build=$1
scenarios=$2
delay_us=1000
name=soda$$h  # of this run's own: network namespaces belong to the whole machine
hosts=("$name"{1..4})

skip() {
  echo "skipped: $1"
  exit 77
}
((EUID == 0)) || skip "network namespaces need root"
for tool in ip mpirun unshare; do
  command -v "$tool" >/dev/null || skip "no $tool"
done
[[ -c /dev/net/tun ]] || skip "no /dev/net/tun"
ip netns add "$name" 2>/dev/null || skip "network namespaces are not allowed"
enters=0
ip netns exec "$name" unshare --uts sh -c 'hostname "$0" && ip link set lo up' "$name" 2>/dev/null && enters=1
ip netns del "$name"
((enters)) || skip "network namespaces cannot be entered"

folder=$(mktemp -d)
switch=
cleanup() {
  [[ -z $switch ]] || kill "$switch" 2>/dev/null || true
  for host in "${hosts[@]}"; do ip netns del "$host" 2>/dev/null || true; done
  rm -rf "$folder"
}
trap cleanup EXIT

# The network.
"$build/delay_switch" "$delay_us" "${hosts[@]}" >"$folder/switch" &
switch=$!
for _ in {1..50}; do
  grep -q ready "$folder/switch" && break
  kill -0 "$switch" 2>/dev/null || skip "TAP devices are not allowed"
  sleep 0.1
done
for i in "${!hosts[@]}"; do
  host=${hosts[i]}
  ip netns add "$host"
  ip link set "$host" netns "$host"
  ip -n "$host" addr add "10.77.0.$((i + 1))/24" dev "$host"
  ip -n "$host" link set "$host" up
  ip -n "$host" link set lo up
done

# What mpirun calls instead of ssh: AGENT ADDRESS COMMAND...
cat >"$folder/agent" <<AGENT
#!/usr/bin/env bash
host=$name\${1##*.}
shift
exec ip netns exec "\$host" unshare --uts sh -c "hostname \$host; \$*"
AGENT
chmod +x "$folder/agent"

on_hosts() {
  ip netns exec "${hosts[0]}" unshare --uts sh -c 'hostname "$0"; exec "$@"' "${hosts[0]}" \
    env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 TMPDIR="$folder" \
    mpirun --mca plm rsh --mca plm_rsh_agent "$folder/agent" --mca pml ob1 --mca btl tcp,self \
    --mca oob_tcp_if_include 10.77.0.0/24 --mca btl_tcp_if_include 10.77.0.0/24 \
    --mca mpi_yield_when_idle 1 --host 10.77.0.1,10.77.0.2,10.77.0.3,10.77.0.4 -n 4 "$@"
}

mapfile -t trips < <(on_hosts "$build/round_trip")
echo "shortest round trips: ${trips[*]} us"
((${#trips[@]} == 3)) || { echo "FAILED: ${#trips[@]} round trips of 3"; exit 1; }
for trip in "${trips[@]}"; do
  ((trip >= 2 * delay_us)) || { echo "FAILED: $trip us is less than twice the delay"; exit 1; }
done

# Of a whole report: who stops reading before its writer is done kills it.
digest() { grep -m 1 -o 'digest.*' <<<"$1" | grep -o '[0-9a-f]\{16\}'; }
check() {
  local alone over
  alone=$(digest "$("$build/soda" "$@")")
  over=$(digest "$(on_hosts "$build/soda" "$@" --executor mpi)")
  echo "soda $*: $alone alone, $over over four hosts"
  [[ $alone == "$over" ]] || { echo "FAILED: not the same digest"; exit 1; }
}
check run "$scenarios/twelve-worlds.json" --steps 60
check run "$scenarios/border-stack.json" --steps 3
check phold --lps 64 --end 20 --remote 0.3 --order-sensitive --zero-delay-rounds 1
