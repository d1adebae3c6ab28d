"""The heavy top: precession, nutation, sleeping."""
