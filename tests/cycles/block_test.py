"""Is the difference of two stacks of noisy pictures more than noise? Block by block, from the scatter of the seeds alone."""

import math
from statistics import NormalDist

import numpy

BLOCK = 8
SIGNIFICANCE = 0.01
# Two programs round differently: a block's standard error never counts as less than this share of its light.
RELATIVE_FLOOR = 1e-4
# Blocks darker than this share of the mean are left out: hairlines of light at grazing angles, where Cycles's sampling of
# triangles rounds (on the rim of the Cornell box's lamplight it finds thrice what the integral gives).
DARK = 1e-3
QUADRATURE_NODES, QUADRATURE_WEIGHTS = numpy.polynomial.legendre.leggauss(64)


def in_blocks(pictures):
    """Sums over blocks of 8x8 pixels of the last two axes; what is left over on the right and below is dropped."""
    height, width = (n // BLOCK * BLOCK for n in pictures.shape[-2:])
    cut = pictures[..., :height, :width]
    return cut.reshape(*cut.shape[:-2], height // BLOCK, BLOCK, width // BLOCK, BLOCK).sum(axis=(-3, -1))


def two_sided_probability(t, freedom):
    """P(|T| >= |t|) for Student's t. With t = sqrt(freedom) cot(phi) it is an integral of sin(phi)^(freedom - 1) from 0."""
    log_gamma = numpy.vectorize(math.lgamma)
    scale = 2.0 * numpy.exp(log_gamma((freedom + 1.0) / 2.0) - log_gamma(freedom / 2.0)) / math.sqrt(math.pi)
    end = numpy.arctan2(numpy.sqrt(freedom), abs(t))
    angles = 0.5 * end[..., None] * (QUADRATURE_NODES + 1.0)
    integral = 0.5 * end * (numpy.sin(angles) ** (freedom[..., None] - 1.0) @ QUADRATURE_WEIGHTS)
    return numpy.clip(scale * integral, 1e-300, 1.0)


def structure_of(ours, theirs):
    """Welch's test of each block of two stacks of pictures [seed, height, width].

    z is what a normal variable of the same probability would be: 1 in the root mean square if there is nothing but
    noise, whatever the number of seeds.
    """
    stacks = in_blocks(ours), in_blocks(theirs)
    means = [s.mean(axis=0) for s in stacks]
    shares = [s.var(axis=0, ddof=1) / len(s) for s in stacks]
    difference = means[0] - means[1]
    light = 0.5 * (means[0] + means[1])
    lit = light > DARK * light.mean()
    variance = numpy.maximum(shares[0] + shares[1], (RELATIVE_FLOOR * light) ** 2)
    variance = numpy.where(lit, variance, 1.0)
    denominator = sum(share ** 2 / (len(s) - 1) for share, s in zip(shares, stacks))
    most = float(sum(len(s) - 1 for s in stacks))
    freedom = numpy.minimum(most, variance ** 2 / numpy.maximum(denominator, variance ** 2 / most))
    t = numpy.where(lit, difference / numpy.sqrt(variance), 0.0)
    probability = two_sided_probability(t, freedom)
    z = numpy.array([-NormalDist().inv_cdf(p / 2.0) for p in probability.ravel()]).reshape(t.shape) * numpy.sign(t)

    count = int(lit.sum())
    alpha = 1.0 - (1.0 - SIGNIFICANCE) ** (1.0 / count)
    pairs = numpy.concatenate([(z[1:] * z[:-1])[lit[1:] & lit[:-1]], (z[:, 1:] * z[:, :-1])[lit[:, 1:] & lit[:, :-1]]])
    square = float((z[lit] ** 2).mean())
    worst = numpy.unravel_index(numpy.argmin(numpy.where(lit, probability, 2.0)), t.shape)
    return {"blocks": count, "pass": float((probability[lit] >= alpha).mean()), "rms_z": math.sqrt(square),
            "worst_z": float(abs(z[worst])), "limit": -NormalDist().inv_cdf(alpha / 2.0),
            "worst_block": [int(worst[1]), int(worst[0])],
            "worst_difference": float(difference[worst] / light[worst]),
            "rms_difference": float(math.sqrt(((difference[lit] / light[lit]) ** 2).mean())),
            "neighbours": float(pairs.mean() / square * math.sqrt(len(pairs)))}
