"""A publisher that knows whether somebody listens."""

from __future__ import annotations

from rclpy.event_handler import PublisherEventCallbacks, QoSPublisherMatchedInfo
from rclpy.node import Node


class HeardPublisher:
    """
    Publishes on a topic; DDS tells it of listeners, so that no sample has to ask.

    Parameters
    ----------
    node : Node
        Whose topic it is; spinning it, listeners become known.
    kind : type
        Of the messages.
    topic : str
        Its name.
    depth : int
        Messages kept.
    """

    def __init__(self, node: Node, kind: type, topic: str, depth: int) -> None:
        self._heard: bool | None = None
        callbacks = PublisherEventCallbacks(matched=self._on_matched)
        self._publisher = node.create_publisher(kind, topic, depth, event_callbacks=callbacks)
        self.publish = self._publisher.publish

    @property
    def heard(self) -> bool:
        """Whether somebody listens."""
        if self._heard is None:  # a node that begins to spin takes what waits before what is told
            self._heard = self._publisher.get_subscription_count() > 0
        return self._heard

    def _on_matched(self, matched: QoSPublisherMatchedInfo) -> None:
        self._heard = matched.current_count > 0
