"""Makes roots.tsv: `python3 roots.py > roots.tsv`, with mpmath 1.3, in some minutes.

A line has a name, the spectral radius of z^n - a_n z^(n-1) - ... - a_1 to 25 digits, its condition (by how many
2^-52 of itself it moves at most where every coefficient moves by 2^-52 of itself, of twelve choices of signs), and
a_1 ... a_n.
"""

import random
from fractions import Fraction

import mpmath as mp

mp.mp.dps = 80
random.seed(1)
EPSILON = mp.mpf(2) ** -52


def polynomial(roots):
    c = [mp.mpc(1)]
    for root in roots:
        c = [(c[k] if k < len(c) else 0) - (root * c[k - 1] if k > 0 else 0) for k in range(len(c) + 1)]
    return [mp.re(x) for x in c]


def pair(modulus, angle):
    re, im = modulus * mp.cos(angle), modulus * mp.sin(angle)
    return [mp.mpc(re, im), mp.mpc(re, -im)]


def in_disc(n, radius):
    roots = []
    while n - len(roots) >= 2:
        x, y = random.uniform(-1, 1), random.uniform(-1, 1)
        if x * x + y * y < 1:
            roots += [mp.mpc(radius * x, radius * y), mp.mpc(radius * x, -radius * y)]
    if len(roots) < n:
        roots.append(mp.mpf(radius * random.uniform(-1, 1)))
    return roots


def cases(n):
    one = mp.mpf(1)
    for _ in range(4):
        yield "disc", polynomial(in_disc(n, random.choice([0.3, 0.9, 1.5])))
    for _ in range(2):
        yield "normal", [1] + [mp.mpf(random.gauss(0, 1)) for _ in range(n)]
    yield "scales", [1] + [mp.mpf(random.gauss(0, 1) * 10 ** random.uniform(-12, 12)) for _ in range(n)]
    yield "multiple", polynomial([mp.mpf(0.75)] * n)
    yield "huge", polynomial([root * mp.mpf(2) ** (900 // n) for root in in_disc(n, 0.9)])
    yield "tiny", polynomial([root * mp.mpf(2) ** (-900 // n) for root in in_disc(n, 0.9)])
    yield "roots of unity", [1] + [0] * (n - 1) + [-1]
    yield "minus", [1] + [0] * (n - 1) + [mp.mpf(0.3)]
    yield "wilkinson", polynomial([mp.mpf(k) / n for k in range(1, n + 1)])
    some = max(n - 2, 1)
    yield "zero root", polynomial(in_disc(some, 0.9) + [mp.mpf(0)] * (n - some))
    yield "geometric", polynomial([mp.mpf(10) ** -k for k in range(n)])
    yield "zero", [1] + [0] * n
    yield "one pole", [1, mp.mpf(-0.5)] + [0] * (n - 1)
    if n >= 2:
        ties = [mp.mpf(0.9), mp.mpf(-0.9) * (1 + mp.mpf(2) ** -40)]
        yield "near ties", polynomial(ties + in_disc(n - 2, 0.5))
        yield "on the circle", polynomial(pair(one, mp.mpf(0.7)) + in_disc(n - 2, 0.9))
        yield "cluster", polynomial(pair(mp.mpf(0.95), mp.mpf(0.001)) + in_disc(n - 2, 0.9))
    if n >= 4:
        first, second = pair(mp.mpf(0.9), one), pair(mp.mpf(0.9), one + mp.mpf(10) ** -6)
        yield "double pair", polynomial(first * 2 + in_disc(n - 4, 0.8))
        yield "near pairs", polynomial(first + second + in_disc(n - 4, 0.8))
        pairs = [pair(one, mp.mpf(random.uniform(0, 3.14))) for _ in range(n // 2)]
        yield "all on the circle", polynomial(sum(pairs, []) + [-one] * (n % 2))
    if n >= 3:
        yield "triple", polynomial([mp.mpf(0.8)] * 3 + in_disc(n - 3, 0.7))


def divide(p, q):
    """Quotient and remainder."""
    p, quotient = list(p), []
    while len(p) >= len(q):
        factor = p[0] / q[0]
        quotient.append(factor)
        p = [x - factor * y for x, y in zip(p, list(q) + [0] * (len(p) - len(q)))][1:]
    while p and p[0] == 0:
        p = p[1:]
    return quotient, p


def fraction(x):
    sign, mantissa, exponent, _ = mp.mpf(x)._mpf_
    return (-1) ** sign * Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def radius(c):
    """Of the exact polynomial without its multiple zeros, which polyroots cannot find."""
    p = [fraction(x) for x in c]
    common, rest = p, [x * (len(p) - 1 - i) for i, x in enumerate(p[:-1])]
    while rest:
        common, rest = rest, divide(common, rest)[1]
    if len(common) > 1:
        p = divide(p, common)[0]
        p = [x / p[0] for x in p]
    c = [mp.mpf(x.numerator) / x.denominator for x in p]
    while len(c) > 1 and c[-1] == 0:
        c = c[:-1]
    if len(c) == 1:
        return mp.mpf(0)
    scale = max(abs(x) ** (mp.mpf(1) / k) for k, x in enumerate(c) if k and x)
    scaled = [x / scale**k for k, x in enumerate(c)]
    return scale * max(abs(z) for z in mp.polyroots(scaled, maxsteps=3000, extraprec=600))


def line(name, a):
    c = [mp.mpf(1)] + [mp.mpf(x) for x in a]
    exact, moved = radius(c), mp.mpf(0)
    for _ in range(12):
        other = c[:1] + [x * (1 + EPSILON * random.choice([-1, 1])) for x in c[1:]]
        moved = max(moved, abs(radius(other) - exact))
    condition = moved / exact / EPSILON if exact else mp.mpf(0)
    return [name, mp.nstr(exact, 25), mp.nstr(condition, 3)] + [repr(-x) for x in reversed(a)]


ALL = [(name, [float(x) for x in c[1:]]) for n in range(1, 13) for name, c in cases(n)]
for name, a in ALL:
    if all(abs(x) < 1e308 for x in a):
        print("\t".join(line(name, a)))
