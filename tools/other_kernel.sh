# What tools/vcan and tools/rt-kernel share: running a command inside another kernel, whose root is this machine's.
# They source it, set `limit` (s), and define
#
#   usage                 their help
#   option NAME           takes an option of their own; fails where there is none of that name
#   mount_writable INDEX  called in there: mounts the folder writable[INDEX]
#   load_can              called in there: checks the kernel and loads its CAN modules
#
# shellcheck shell=bash disable=SC2154  # limit

fail() {
  printf '%s: %s\n' "${0##*/}" "$2" >&2
  exit "$1"
}

# read_arguments ARGUMENT...: sets limit and command.
read_arguments() {
  while (($#)); do
    case $1 in
      -h | --help) usage && exit ;;
      --timeout)
        limit=${2-}
        if [[ ! $limit =~ ^[1-9][0-9]*$ ]]; then fail 2 "--timeout needs whole seconds, not '$limit'"; fi
        shift 2
        ;;
      -*)
        option "$1" || fail 2 "does not know $1; tools/${0##*/} --help lists what it does"
        shift
        ;;
      *) break ;;
    esac
  done
  if (($# == 0)); then usage >&2 && exit 2; fi
  command=("$@")
}

# The first process of the other kernel, whose root is this machine's, read-only. Knows $job and $writable.
# shellcheck disable=SC2317  # called in there
boot() {
  set -euo pipefail
  PATH=/usr/sbin:/usr/bin:/sbin:/bin
  mount -t proc proc /proc
  trap 'echo o >/proc/sysrq-trigger; sleep 60' EXIT # powers off; unlike poweroff, it is on every Debian
  mount -t sysfs sysfs /sys
  mkdir -p /dev/shm /dev/pts
  mount -t devpts devpts /dev/pts
  local folder index
  for folder in /dev/shm /run /tmp; do mount -t tmpfs tmpfs "$folder"; done
  for index in "${!writable[@]}"; do
    mkdir -p "${writable[index]}" # one in /tmp has just been hidden
    mount_writable "$index"
  done
  load_can
  ip link add dev vcan0 type vcan
  ip link set vcan0 up
  ip link set lo up
  local code=0
  bash "$job/command" </dev/null >"$job/stdout" 2>"$job/stderr" || code=$?
  echo "$code" >"$job/code"
}

# shellcheck disable=SC2317  # the trap calls it
clean_up() {
  trap '' INT TERM HUP
  if [[ ${kernel-} ]]; then
    kill "$kernel" 2>/dev/null || true
    wait
  fi
  rm -rf "$job"
}

# prepare_job VARIABLE...: makes the folder $job, with the command and with init, which the other kernel is to start and
# which knows the variables; sets $writable.
prepare_job() {
  # In /tmp whatever TMPDIR says: the path stands on a kernel's command line, which knows no spaces.
  job=$(mktemp -d "/tmp/tendril-${0##*/}.XXXXXX")
  trap clean_up EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM HUP

  writable=("$job")
  if [[ $PWD != / ]]; then writable+=("$PWD"); fi
  if [[ -d ${tools%/*}/build ]]; then writable+=("${tools%/*}/build"); fi
  {
    echo '#!/bin/bash'
    declare -p job writable "$@"
    declare -f boot mount_writable load_can
    echo boot
  } >"$job/init"
  {
    export -p
    printf 'unset TMPDIR\ncd %q\nexec' "$PWD"
    printf ' %q' "${command[@]}"
  } >"$job/command"
  chmod +x "$job/init"
  touch "$job/stdout" "$job/stderr"
}

# run_job NAME KERNEL ARGUMENT...: starts the kernel called NAME, hands on what the command prints, and exits as it did.
run_job() {
  # The command's output goes through files: a console would turn \n into \r\n and mix the two streams.
  timeout --kill-after=5 "$limit" "${@:2}" </dev/null &>"$job/log" &
  kernel=$!
  tail --pid="$kernel" --sleep-interval=0.1 --lines=+1 --follow "$job/stdout" &
  tail --pid="$kernel" --sleep-interval=0.1 --lines=+1 --follow "$job/stderr" >&2 &
  local ended=0
  wait "$kernel" || ended=$?
  kernel=
  wait
  if [[ -s $job/code ]]; then exit "$(<"$job/code")"; fi
  if ((ended == 124 || ended == 137)); then fail 124 "ended after $limit s: ${command[0]##*/} took too long"; fi
  tail -n 20 "$job/log" >&2
  fail 3 "$1 did not come as far as to run the command; above is what it said last"
}
