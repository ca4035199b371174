"""Unix sockets that listen: where they are, and whose groups may open them."""

from __future__ import annotations

import errno
import logging
import os
import shutil
import socket
import stat
import struct
from collections.abc import Iterable
from pathlib import Path

from canhelm import protocol
from canhelm.errors import ConfigError, PermissionRefused, Refused
from daemon.api.peers import Rights

LOGGER = logging.getLogger("canhelm.api")
LONGEST_PATH = 107
"""Bytes in the path of a Unix socket (unix(7): sun_path with the zero at its end)."""
_ACL = "system.posix_acl_access"
_ACL_VERSION = struct.pack("<I", 2)
_ACL_ENTRY = struct.Struct("<HHI")
_OWNER, _GROUP, _NAMED_GROUP, _MASK, _OTHER = 0x01, 0x04, 0x08, 0x10, 0x20
_READ_WRITE, _NOTHING, _NOBODY = 6, 0, 0xFFFF_FFFF
"""Of an access control list as the kernel takes it (linux/posix_acl_xattr.h)."""


def open_listener(path: Path, rights: Rights, option: str = "--socket") -> socket.socket:
    """A listening socket at a path, 0660, for the groups that may use the robot; a dead daemon's is replaced.

    Args:
        path: where.
        rights: which groups those are.
        option: how a person chooses another place.

    Raises:
        Refused: another daemon answers there.
        ConfigError: the path is too long or taken by something that is no socket.
        PermissionRefused: this user may not create it.
    """
    try:
        _own_folder(path.parent, option)
        _clear_stale(path, option)
        listener = _bind(path)
    except PermissionError as error:
        raise PermissionRefused(
            f"no socket can be opened at {path}: {error.strerror}", remedy=f"choose another place with {option} PATH"
        ) from None
    except OSError as error:
        raise ConfigError(
            f"no socket can be opened at {path}: {error.strerror}", remedy=f"choose another place with {option} PATH"
        ) from None
    _give_to_groups(path, rights)
    return listener


def _bind(path: Path) -> socket.socket:
    if len(os.fsencode(path)) > LONGEST_PATH:
        raise OSError(errno.ENAMETOOLONG, f"the path is longer than {LONGEST_PATH} bytes")
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    before = os.umask(0o117)
    try:
        listener.bind(os.fspath(path))
    except OSError:
        listener.close()
        raise
    finally:
        os.umask(before)
    return listener


def remove_socket(path: Path, inode: int) -> None:
    """Take a socket away, unless another one has taken its place since, or it is not ours (``inode`` 0)."""
    try:
        if inode and os.stat(path).st_ino == inode:
            os.unlink(path)
    except FileNotFoundError:
        pass


def _own_folder(folder: Path, option: str) -> None:
    """Make the folder; a shared place such as /tmp must not hold one that somebody else has put there."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder == protocol.user_folder():
        found = os.lstat(folder)
        if found.st_uid != os.getuid() or not stat.S_ISDIR(found.st_mode):
            raise PermissionRefused(f"{folder} belongs to somebody else", remedy=f"choose a place with {option} PATH")


def _clear_stale(path: Path, option: str) -> None:
    try:
        mode = os.lstat(path).st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise ConfigError(f"{path} is there and is no socket", remedy=f"choose another place with {option} PATH")
    if protocol.is_live(path):
        raise Refused(f"a daemon already answers on {path}", remedy=f"stop it first, or give this one {option} PATH")
    os.unlink(path)


def _give_to_groups(path: Path, rights: Rights) -> None:
    """Let the groups open it: one as the file's own, all by an access control list where the file system has any."""
    try:
        shutil.chown(path, group=rights.driving)
    except (LookupError, PermissionError):
        LOGGER.info("group %s is not there or not ours: %s stays with this user's group", rights.driving, path)
    if rights.numbers:
        try:
            os.setxattr(path, _ACL, make_acl(rights.numbers))
        except OSError as error:
            if error.errno not in (errno.ENOTSUP, errno.EPERM):
                raise
            LOGGER.warning("%s has no access control lists: only its own group may open it", path.parent)


def make_acl(groups: Iterable[int]) -> bytes:
    """An access control list: owner, the file's group and these groups read and write, nobody else does anything."""
    named = [(_NAMED_GROUP, _READ_WRITE, group) for group in sorted(groups)]
    entries = [(_OWNER, _READ_WRITE, _NOBODY), (_GROUP, _READ_WRITE, _NOBODY), *named]
    entries += [(_MASK, _READ_WRITE, _NOBODY), (_OTHER, _NOTHING, _NOBODY)]
    return _ACL_VERSION + b"".join(_ACL_ENTRY.pack(*entry) for entry in entries)
