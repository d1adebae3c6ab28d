"""The disk that rolls on a plane without slipping."""
