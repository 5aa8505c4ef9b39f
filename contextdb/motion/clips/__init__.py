"""Clips: files of several formats, skeletons, poses, paths, footfalls."""
