"""Stage name -> function, subcommand -> pipeline: the one table that knows every system by name."""

from pathlib import Path

_HERE = Path(__file__).parent

STAGES = {
    "dead-reckon": "logpose.pipelines.odometry.dead_reckon:dead_reckon",
    "detect-circles": "logpose.pipelines.detect_circles.stage:detect_circles",
    "evaluate": "logpose.pipelines.evaluate.stage:evaluate",
    "fuse-poses": "logpose.pipelines.fuse.stage:fuse_poses",
    "localize-pf": "logpose.pipelines.localize_pf.stage:localize_pf",
    "read-sightings": "logpose.pipelines.read:read_sightings",
    "read-truth": "logpose.pipelines.read:read_truth",
    "stripe-pose": "logpose.pipelines.stripe_pose.stage:stripe_pose",
    "write-log": "logpose.pipelines.report.record:write_log",
    "write-mark-overlays": "logpose.pipelines.stripe_pose.stage:write_mark_overlays",
    "write-mark-poses": "logpose.pipelines.write:write_mark_poses",
    "write-overlays": "logpose.pipelines.detect_circles.stage:write_overlays",
    "write-picture": "logpose.pipelines.report.stage:write_picture",
    "write-report": "logpose.pipelines.report.stage:write_report",
    "write-sightings": "logpose.pipelines.write:write_sightings",
    "write-trajectory": "logpose.pipelines.write:write_trajectory",
}

SUITS = {
    "detect-circles": ("image",),
    "localize-pf": ("image|sightings", "odometry"),
    "stripe-pose": ("image",),
}
"""Subcommand that runs a pipeline -> roles a log must be able to fill; alternatives separated by a bar."""

PIPELINES = {name: _HERE / word / f"{word}.yaml" for name in SUITS for word in [name.replace("-", "_")]}
"""Subcommand -> its bundled pipeline, which lies in the folder of the same name."""
