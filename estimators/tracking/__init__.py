"""Spin rate over a whole recording: a smoother of the field vector with precession, hard and soft iron estimated.

The readings are modelled as vectors, ``m_k = (I + S) C(t_k) m_0 + b + noise``, where the attitude C integrates the
body rates (p, q, r): p and q from the gyroscope, r(t) a spline with a smoothness prior whose strength the data decide
(largest marginal likelihood). So precession drops out exactly and not to first order. Maximum a posteriori by
Gauss-Newton; standard deviations from the inverse Hessian. Without a gyroscope p and q are smooth unknown functions
in the frame that does not spin, and what the field cannot show of them stays in the standard deviation.
Derivation, and what is unobservable: docs/spin-phase.md.
"""

from discsim.estimators.tracking.problem import Segment
from discsim.estimators.tracking.recordings import joined, plain_tracks, tracking, tracks_of
from discsim.estimators.tracking.smoother import track_bound, track_spin
from discsim.estimators.tracking.track import RateRows, Track, TrackingSettings

__all__ = [
    "RateRows",
    "Segment",
    "Track",
    "TrackingSettings",
    "joined",
    "plain_tracks",
    "track_bound",
    "track_spin",
    "tracking",
    "tracks_of",
]
