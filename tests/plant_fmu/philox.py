"""Philox 4x32-10 in plain integers, checked against the known answers published with Random123."""

import math

M0, M1, W0, W1, MASK = 0xD2511F53, 0xCD9E8D57, 0x9E3779B9, 0xBB67AE85, 0xFFFFFFFF

KNOWN = [  # counter, key, result: kat_vectors of Random123
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((MASK,) * 4, (MASK,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    ((0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344), (0xA4093822, 0x299F31D0),
     (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1)),
]  # fmt: skip


def philox(counter, key):
    c, (k0, k1) = list(counter), key
    for _ in range(10):
        a, b = M0 * c[0], M1 * c[2]
        c = [(b >> 32) ^ c[1] ^ k0, b & MASK, (a >> 32) ^ c[3] ^ k1, a & MASK]
        k0, k1 = (k0 + W0) & MASK, (k1 + W1) & MASK
    return tuple(c)


def normal(seed, stream, count):
    c = philox((count & MASK, count >> 32, stream, 0), (seed, 0))
    u = ((c[0] >> 5) * 2**26 + (c[1] >> 6) + 1) / 2**53
    v = ((c[2] >> 5) * 2**26 + (c[3] >> 6)) / 2**53
    return math.sqrt(-2 * math.log(u)) * math.cos(2 * math.pi * v)


def uniform(seed, stream, count):
    """Two numbers in [0, 1)."""
    c = philox((count & MASK, count >> 32, stream, 0), (seed, 0))
    return [((c[i] >> 5) * 2**26 + (c[i + 1] >> 6)) / 2**53 for i in (0, 2)]
