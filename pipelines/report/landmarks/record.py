"""Landmarks in the log of a run: the map, what was seen as JSON, and circles over the image."""

from dataclasses import replace

import numpy as np

from ....formats.events import TRUE_SIGHTINGS, Event, Sightings
from ....formats.foxglove import IMAGE_ANNOTATIONS, SCENE_UPDATE, image_annotations, landmark_scene
from ....formats.products import LandmarkMap
from ....formats.write_log import LogWriter


class LandmarkRecorder:
    """Writes the map before the first message, then what belongs to each event."""

    def __init__(self, log: LogWriter, landmarks: LandmarkMap | None) -> None:
        self._log = log
        self._landmarks = landmarks
        self._circled: set[str] = set()

    def take(self, event: Event) -> None:
        """Write what belongs in the log of one event."""
        if self._landmarks is not None:
            self._log.write_message(
                "/landmarks", SCENE_UPDATE, event.stamp, landmark_scene(self._landmarks, event.stamp)
            )
            self._landmarks = None
        if isinstance(event, Sightings) and event.source != TRUE_SIGHTINGS:
            self._log.write(replace(event, topic=f"/{event.source}/sightings"))
            if np.isfinite(event.uv).any():
                self._circled.add(event.source)
            if event.source in self._circled:  # also when nothing was seen, to clear the circles of the image before
                topic = f"/{event.source}/annotations"
                self._log.write_message(topic, IMAGE_ANNOTATIONS, event.stamp, image_annotations(event))

    def end(self) -> None:
        """Write what is known only now: nothing."""
