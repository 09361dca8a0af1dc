"""The subscription to the motion, and what can be known of those who publish it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.qos_overriding_options import QoSOverridingOptions

from slosh_ros.ros.news import News

# Heard from reliable and best-effort sensors alike; deep enough for a burst after a stall
_SENSOR = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_OVERRIDABLE = {'RELIABILITY': 'best_effort'}  # policies that a parameter can relax, and how


class MotionInput:
    """
    Subscribes to the motion.

    Parameters
    ----------
    node : Node
        Whose subscription it is.
    kind : type
        Class of the messages.
    topic : str
        Before remapping.
    callback : callable
        Takes a message.
    news : News
        Is told what does not fit.
    raw : bool
        Whether the callback takes the message's bytes instead; rclpy takes ten times longer to
        make a message of them than all the rest takes.

    Attributes
    ----------
    topic : str
        Resolved name.
    type_name : str
        As `sensor_msgs/msg/Imu`.
    matched : int
        Publishers that are connected.
    lost : bool
        Whether there has been one, and is none.
    mismatch : str
        What a publisher offers that the subscription cannot take, and the remedy; empty if none.
    """

    def __init__(
        self,
        node: Node,
        kind: type,
        topic: str,
        callback: Callable[[Any], None],
        news: News,
        *,
        raw: bool = False,
    ) -> None:
        self._node = node
        self._news = news
        self._asked = topic
        self.type_name = f'{kind.__module__.partition(".")[0]}/msg/{kind.__name__}'
        self.matched = 0
        self.lost = False
        self.mismatch = ''
        self._rivals: list[str] | None = []
        subscription = node.create_subscription(
            kind,
            topic,
            callback,
            _SENSOR,
            raw=raw,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=self._on_incompatible, matched=self._on_matched
            ),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self.topic = subscription.topic_name

    def hint(self) -> str:
        """Tell why nothing may be coming, and the remedy; empty if nothing is known."""
        if self.mismatch and not self.matched:
            return self.mismatch
        others = [
            info for info in self._node.get_publishers_info_by_topic(self.topic)
            if info.topic_type != self.type_name
        ]  # fmt: skip
        if others:
            return f'{_name(others[0])} publishes {others[0].topic_type} there'
        if self.lost:
            return 'its publisher is gone'
        if self.matched:
            return 'its publisher is there but silent'
        found = sorted(
            name
            for name, kinds in self._node.get_topic_names_and_types()
            if self.type_name in kinds and name != self.topic and self._node.count_publishers(name)
        )
        if found:
            return f'there is one on {", ".join(found)}: remap with -r {self._asked}:={found[0]}'
        return ''

    def rivals(self) -> list[str]:
        """Names of the publishers if there are several, else none."""
        if self.matched < 2:
            return []
        if self._rivals is None:  # asking costs more than a sample: only after a change
            infos = self._node.get_publishers_info_by_topic(self.topic)
            self._rivals = sorted(_name(i) for i in infos if i.topic_type == self.type_name)
        return self._rivals

    def _on_matched(self, info: Any) -> None:
        self.matched = info.current_count
        self.lost = self.matched == 0
        self._rivals = None

    def _on_incompatible(self, info: Any) -> None:
        policy = qos_policy_name_from_kind(info.last_policy_kind)
        relaxed = _OVERRIDABLE.get(policy)
        self.mismatch = f'a publisher on {self.topic} offers less {policy} than is asked for; ' + (
            f'set qos_overrides.{self.topic}.subscription.{policy.lower()} to {relaxed}'
            if relaxed
            else 'make it offer more'
        )
        self._news.tell('QoS', self.mismatch)


def _name(info: Any) -> str:
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'
