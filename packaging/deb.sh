#!/bin/sh
# Builds the Debian package into dist/: packaging/deb.sh, called by `make deb`.
set -eu
cd "$(dirname "$0")/.."
version=$(sed -n 's/^__version__ = "\(.*\)"/\1/p' canhelm/__init__.py)
architecture=$(dpkg --print-architecture)
mkdir -p dist
root=$(mktemp -d)
finished=$(mktemp -d dist/.new-XXXXXX) # what reads dist/ meanwhile shall never see half a package
trap 'rm -rf "$root" "$finished"' EXIT
chmod 755 "$root"
umask 022

DESTDIR=$root PREFIX=/opt/canhelm packaging/install.sh
cp LICENSE "$root/usr/share/doc/canhelm/copyright"
gzip -9n <CHANGELOG.md >"$root/usr/share/doc/canhelm/changelog.gz"

mkdir "$root/DEBIAN"
install -m 755 packaging/debian/postinst packaging/debian/prerm packaging/debian/postrm "$root/DEBIAN"
sed -e "s/@VERSION@/${VERSION:-$version}/" -e "s/@ARCHITECTURE@/$architecture/" \
	-e "s/@PYTHON@/$($PYTHON -c 'import sys; print(f"python3 (>= 3.{sys.version_info[1]}~), python3 (<< 3.{sys.version_info[1] + 1}~)")')/" \
	-e "s/@SIZE@/$(du -ks "$root" | cut -f1)/" packaging/debian/control >"$root/DEBIAN/control"
(cd "$root" && find etc -type f -printf '/%p\n') >"$root/DEBIAN/conffiles"
(cd "$root" && find opt usr -type f -print0 | xargs -0 md5sum) >"$root/DEBIAN/md5sums"

dpkg-deb --root-owner-group -Zgzip --build "$root" "$finished"
mv "$finished"/*.deb dist
