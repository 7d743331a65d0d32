"""Uncertainty itself: keyed draws, sampling plans, maximum entropy; plain arrays in and out."""
