# Runs the command as a service of a real systemd, in a copy-on-write view of the host's files that is thrown away;
# sourced by the guest's first process.
insmod "$here/modules/fs/overlayfs/overlay.ko"

# The new root: the host's files below, a RAM disk above.
mount -t tmpfs -o size=75% tmpfs /mnt
mkdir /mnt/upper /mnt/work /mnt/root
mount -t overlay -o lowerdir=/,upperdir=/mnt/upper,workdir=/mnt/work overlay /mnt/root
cd /mnt/root || exit
for folder in proc sys dev run; do mount --move "/$folder" "$folder"; done

# A machine of its own: not a container, none of the host's services, mounts and memory of names.
rm -rf .dockerenv run/.containerenv etc/systemd/system/*.wants etc/systemd/system/*.requires
: >etc/fstab
echo 00000000000000000000000000000001 >etc/machine-id
mkdir -p etc/tmpfiles.d run/systemd/system
ln -sf /dev/null etc/tmpfiles.d/tmp.conf # boot would sweep the host's /tmp, file by file, through the RAM disk
rm -f var/lib/man-db/auto-update # each installed package would have all pages of the machine read anew
for unit in systemd-binfmt.service proc-sys-fs-binfmt_misc.automount; do # modules that this kernel has not
	ln -s /dev/null "run/systemd/system/$unit"
done
cat >run/systemd/system/guest.target <<'UNIT'
[Unit]
Description=The guest's command
Requires=basic.target dbus.socket
Wants=guest.service
After=basic.target dbus.socket
UNIT
cat >run/systemd/system/guest.service <<'UNIT'
[Unit]
Description=The command that this guest was booted for
After=basic.target dbus.socket
SuccessAction=poweroff-immediate
FailureAction=poweroff-immediate

[Service]
Type=exec
ExecStart=/bin/sh -c '/run/guest/command >/dev/console 2>&1; echo $$? >/run/guest/status.new'
ExecStopPost=/bin/sh -c 'echo 0 >/proc/sys/kernel/printk; mv /run/guest/status.new /run/guest/status'
UNIT

pivot_root . mnt
exec chroot . /bin/sh -c 'umount -l /mnt; exec /lib/systemd/systemd' </dev/console >/dev/console 2>&1
