#!/bin/bash
# Drives a robot from the shell: JSON-RPC over the daemon's socket, by socat. No canhelm is needed here.
# Start a daemon first (`canhelm run --simulate --profile max2d`), then `examples/talk.sh SOCKET`.
set -eu
[ $# -eq 1 ] || { echo "usage: $0 SOCKET (\`canhelm doctor\` says where it is)" >&2; exit 2; }

coproc daemon { socat - "UNIX-CONNECT:$1"; }

ask() { # METHOD PARAMS: one request, one answer
	printf '{"jsonrpc":"2.0","id":1,"method":"%s","params":%s}\n' "$1" "$2" >&"${daemon[1]}"
	read -r answer <&"${daemon[0]}"
	case $answer in *'"error"'*) echo "$1 refused: $answer" >&2; exit 1 ;; esac
}

field() { # NAME: its value in the answer
	sed -n "s/.*\"$1\":\"\{0,1\}\([^\",}]*\).*/\1/p" <<<"$answer"
}

ask hello '{}'
echo "robot $(field robot) is $(field state)"

# A motion that is handed to the daemon (wait: false) needs no renewing of a lease while it is waited for.
ask drive.parallel '{"angle_deg":0,"speed_m_s":0.3,"duration_s":1,"wait":false}'
ask motion.wait "{\"motion\":\"$(field motion)\"}"
echo "driven in $(field duration_s) s"
