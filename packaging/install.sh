#!/bin/sh
# Installs canhelm as a service: packaging/install.sh [files|help], called by `make install`; "files" leaves out the program
# and what it makes itself, "help" is that alone: pages for man, completions of shells, reference pages.
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
	"$PIP_PYTHON" -m pip --python "$root$prefix/bin/python3" install --quiet --disable-pip-version-check --no-compile '.[slcan,web]'
	find "$root$prefix/lib" -name direct_url.json -delete
	find "$root$prefix/lib" -depth -path '*/site-packages/*/tests' -exec rm -rf {} + # those of libraries
	grep -lIr "$root$prefix" "$root$prefix/bin" "$root$prefix/pyvenv.cfg" | xargs -r sed -i "s|$root$prefix|$prefix|g"
	"$root$prefix/bin/python3" -m compileall -q -s "$root" -p / "$root$prefix/lib"
	mkdir -p "$root/usr/bin"
	ln -sfn "$prefix/bin/canhelm" "$root/usr/bin/canhelm"
}

install_help() { # made by the installed program from its own tables
	completions=$(mktemp -d)
	"$root$prefix/bin/python3" -P -m daemon.reference \
		man "$root/usr/share/man/man1" pages "$doc/reference" completions "$completions"
	put "$completions/canhelm" "$root/usr/share/bash-completion/completions/canhelm"
	put "$completions/_canhelm" "$root/usr/share/zsh/vendor-completions/_canhelm"
	put "$completions/canhelm.fish" "$root/usr/share/fish/vendor_completions.d/canhelm.fish"
	rm -r "$completions"
	gzip -9nf "$root"/usr/share/man/man1/canhelm*.1
	chmod 644 "$root"/usr/share/man/man1/canhelm*.1.gz "$doc"/reference/*
}

install_files() {
	for unit in canhelm@.service canhelm@.socket canhelm-station.service can@.service; do put "systemd/$unit" "$lib/systemd/system/$unit"; done
	put systemd/canhelm.sysusers "$lib/sysusers.d/canhelm.conf"
	put systemd/canhelm.tmpfiles "$lib/tmpfiles.d/canhelm.conf"
	put systemd/canhelm.sysctl "$lib/sysctl.d/60-canhelm.conf"
	put systemd/canhelm.rules "$lib/udev/rules.d/60-canhelm.rules"
	put systemd/canhelm.needrestart "$root/etc/needrestart/conf.d/canhelm.conf"
	[ -e "$root/etc/canhelm/canhelm.env" ] || put systemd/canhelm.env "$root/etc/canhelm/canhelm.env"
	mkdir -p "$root/etc/canhelm/robots"
	for example in systemd/examples/*; do put "$example" "$doc/examples/${example##*/}"; done
	for page in docs/*.md; do put "$page" "$doc/${page##*/}"; done
}

make_known() { # to the running system: users, folders, units, rules
	systemd-sysusers canhelm.conf
	systemd-tmpfiles --create canhelm.conf
	[ -d /run/systemd/system ] || return 0
	systemctl daemon-reload
	sysctl --quiet --load=/usr/lib/sysctl.d/60-canhelm.conf || true
	command -v udevadm >/dev/null && udevadm control --reload || true
}

case "${1:-all}" in
files | help)
	"install_$1"
	exit
	;;
esac
case "$("$PYTHON" -c 'import sys; print(sys.base_prefix.split("/")[1])')" in
home | root) # what ProtectHome= hides
	echo "$PYTHON lives in a home folder, which the service may not see: make SERVICE_PYTHON=/usr/bin/python3 install" >&2
	exit 1
	;;
esac
install_files
install_program
install_help
if [ -z "$root" ]; then make_known; fi
