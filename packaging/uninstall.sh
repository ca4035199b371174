#!/bin/sh
# Takes away what `make install` has put there; profiles, logs and state stay.
set -eu
prefix=${PREFIX:-/opt/canhelm}
root=${DESTDIR:-}
lib=$root/usr/lib
if [ -z "$root" ] && [ -d /run/systemd/system ]; then
	systemctl stop 'canhelm*.service' 'canhelm@*.socket'
fi
rm -rf "$root$prefix" "$root/usr/share/doc/canhelm"
rm -f "$root/usr/share/man/man1/canhelm.1.gz" "$root"/usr/share/man/man1/canhelm-*.1.gz \
	"$root/usr/share/bash-completion/completions/canhelm" "$root/usr/share/zsh/vendor-completions/_canhelm" \
	"$root/usr/share/fish/vendor_completions.d/canhelm.fish"
rm -f "$root/usr/bin/canhelm" "$root/etc/needrestart/conf.d/canhelm.conf" \
	"$lib/systemd/system/canhelm@.service" "$lib/systemd/system/canhelm@.socket" "$lib/systemd/system/can@.service" \
	"$lib/systemd/system/canhelm-station.service" \
	"$lib/sysusers.d/canhelm.conf" "$lib/tmpfiles.d/canhelm.conf" "$lib/sysctl.d/60-canhelm.conf" \
	"$lib/udev/rules.d/60-canhelm.rules"
if [ -z "$root" ] && [ -d /run/systemd/system ]; then
	systemctl daemon-reload
fi
