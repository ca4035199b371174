#!/bin/sh
# Installs canhelm as a service: packaging/install.sh [files], called by `make install`; "files" leaves the program out.
# DESTDIR is where a package is put together, empty for this machine; PREFIX is where the program will live.
set -eu
cd "$(dirname "$0")/.."
prefix=${PREFIX:-/opt/canhelm}
root=${DESTDIR:-}
lib=$root/usr/lib
doc=$root/usr/share/doc/canhelm

put() { # FILE TARGET: a file, with the program's place in it
	mkdir -p "$(dirname "$2")"
	sed "s|/opt/canhelm|$prefix|g" "$1" >"$2"
	chmod 644 "$2"
}

install_program() { # an environment of its own, without pip, as if it had been made in $prefix
	mkdir -p "$root$prefix"
	"$PYTHON" -m venv --clear --without-pip "$root$prefix"
	"$PIP_PYTHON" -m pip --python "$root$prefix/bin/python3" install --quiet --disable-pip-version-check --no-compile '.[slcan]'
	find "$root$prefix/lib" -name direct_url.json -delete
	find "$root$prefix/lib" -depth -path '*/site-packages/*/tests' -exec rm -rf {} + # those of libraries
	grep -lIr "$root$prefix" "$root$prefix/bin" "$root$prefix/pyvenv.cfg" | xargs -r sed -i "s|$root$prefix|$prefix|g"
	"$root$prefix/bin/python3" -m compileall -q -s "$root" -p / "$root$prefix/lib"
	mkdir -p "$root/usr/bin"
	ln -sfn "$prefix/bin/canhelm" "$root/usr/bin/canhelm"
}

install_files() {
	for unit in canhelm@.service canhelm@.socket can@.service; do put "systemd/$unit" "$lib/systemd/system/$unit"; done
	put systemd/canhelm.sysusers "$lib/sysusers.d/canhelm.conf"
	put systemd/canhelm.tmpfiles "$lib/tmpfiles.d/canhelm.conf"
	put systemd/canhelm.sysctl "$lib/sysctl.d/60-canhelm.conf"
	put systemd/canhelm.rules "$lib/udev/rules.d/60-canhelm.rules"
	put systemd/canhelm.needrestart "$root/etc/needrestart/conf.d/canhelm.conf"
	[ -e "$root/etc/canhelm/canhelm.env" ] || put systemd/canhelm.env "$root/etc/canhelm/canhelm.env"
	mkdir -p "$root/etc/canhelm/robots"
	for example in systemd/examples/*; do put "$example" "$doc/examples/${example##*/}"; done
	put docs/service.md "$doc/service.md"
}

make_known() { # to the running system: users, folders, units, rules
	systemd-sysusers canhelm.conf
	systemd-tmpfiles --create canhelm.conf
	[ -d /run/systemd/system ] || return 0
	systemctl daemon-reload
	sysctl --quiet --load=/usr/lib/sysctl.d/60-canhelm.conf || true
	command -v udevadm >/dev/null && udevadm control --reload || true
}

install_files
[ "${1:-all}" = files ] && exit
case "$("$PYTHON" -c 'import sys; print(sys.base_prefix.split("/")[1])')" in
home | root) # what ProtectHome= hides
	echo "$PYTHON lives in a home folder, which the service may not see: make SERVICE_PYTHON=/usr/bin/python3 install" >&2
	exit 1
	;;
esac
install_program
if [ -z "$root" ]; then make_known; fi
