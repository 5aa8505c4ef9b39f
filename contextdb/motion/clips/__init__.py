"""Clips: BVH files, skeletons, poses, paths, footfalls."""
