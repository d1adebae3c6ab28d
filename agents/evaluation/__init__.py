"""Episodes of policies on unseen starts: figures, intervals, reports, plots."""
