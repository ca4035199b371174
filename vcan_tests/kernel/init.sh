#!/bin/sh
# The guest's first process: mounts what programs expect, loads the CAN modules, brings up vcan0 and vcan1, then
# goes on with the file "run" beside this one.
here=$(dirname "$0")
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

mount -t proc proc /proc
mount -t sysfs sysfs /sys
mkdir -p /dev/pts /dev/shm
mount -t devpts -o gid=5,mode=620,ptmxmode=666 devpts /dev/pts
mount -t tmpfs tmpfs /dev/shm
mount -t tmpfs -o mode=755 tmpfs /run
mkdir -m 1777 /run/tmp
mkdir /run/lock /run/guest
mount -t hostfs -o "$here" none /run/guest
uname -r >/run/guest/kernel

for module in net/can/can net/can/can-raw net/can/can-bcm net/can/can-gw drivers/net/can/dev/can-dev \
	drivers/net/can/vcan drivers/net/can/vxcan drivers/net/can/slcan/slcan lib/crc-ccitt net/ipv6/ipv6; do
	insmod "$here/modules/$module.ko"
done
echo 8388608 >/proc/sys/net/core/rmem_max # a CAN socket's default of 212992 holds 277 frames only
ip link set lo up
for bus in vcan0 vcan1; do
	ip link add "$bus" type vcan
	ip link set "$bus" txqueuelen 1000 up
done

stty -opost </dev/console # bytes as they are: no carriage return before a line feed
. "$here/run"
