"""What the CiA 309-3 gateway answers to ``help``. Each text is short enough to be read in one piece by its clients."""

from __future__ import annotations

HELP = {
    "": """\
[SEQ] [[NET] NODE] COMMAND   # one a line; SEQ in brackets comes back with the answer
  read INDEX SUB [TYPE]              r; SDO upload, as hex without a TYPE
  write INDEX SUB TYPE VALUE         w; SDO download
  start | stop | preop               NMT; node 0: all nodes
  reset node | reset comm            NMT
  set node N | set network N         default of this connection
  set sdo_timeout MS                 500 unless set
  set sdo_block 0|1                  block transfer where it pays
  info version, led, log             the gateway, the vehicle's state, the last events
  help datatype | help lss
After [SEQ] comes OK, a value, ERROR:N #why, or ERROR:0x06020000 #why (SDO abort).
Writing, NMT and LSS need a daemon started with --gateway-write.""",
    "datatype": """\
b                0 or 1
i8 i16 i32 i64   signed;   u8 u16 u32 u64   unsigned;   x8 x16 x32 x64   unsigned, shown in hex
r32 r64          real
vs               text; in "double quotes" where it has blanks, a quote in it doubled
os us d          octets, unicode, domain: base64
hex              pairs of digits in the order on the wire: E8 03 is 1000
Numbers are written as in C: 1000, 0x3E8, 01750.""",
    "lss": """\
lss_switch_glob 0|1                          all nodes: waiting | configuration
lss_switch_sel VENDOR PRODUCT REVISION SERIAL
lss_set_node ID                              1 to 127, 255: none
lss_conf_bitrate 0 INDEX                     0: 1000k 1: 800k 2: 500k 3: 250k 4: 125k 6: 50k 7: 20k 8: 10k 9: auto
lss_activate_bitrate DELAY_MS
lss_store
lss_inquire_addr [0..3]                      vendor, product, revision, serial
lss_get_node
_lss_fastscan [MS]                           find one node without an id
lss_allnodes [MS [START STORE [SCAN VALUE, four times]]]
                                             give ids to all; SCAN 0: search, 1: ignore, 2: VALUE""",
}
