"""A sensor's rows as a logger wrote them: held, late, lost, frozen and failed ones, and the times of its readings."""
