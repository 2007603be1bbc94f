"""A program for MAVSDK that flies off board and says what MAVSDK tells it, a line of JSON each.

    mavlink_watcher.py PORT

Each second it asks for OFFBOARD, so that a vehicle that has left that mode returns to it, and for a rate of the position.
"""

import asyncio
import json
import sys
from typing import Any, Awaitable

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action.action import ActionAsync
from mavsdk.asyncio.plugins.offboard.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync
from mavsdk.plugins.offboard.offboard import VelocityBodyYawspeed

FORWARD = VelocityBodyYawspeed(0.5, 0.0, 0.0, 0.0)


def say(**fields: Any) -> None:
    print(json.dumps(fields), flush=True)


async def tried(name: str, act: Awaitable[Any]) -> bool:
    """Says how a call ended."""
    try:
        await act
    except Exception as error:
        say(call=name, result=str(error).partition(";")[0] or type(error).__name__)
        return False
    say(call=name, result="SUCCESS")
    return True


async def watch(system: Any) -> None:
    async for connected in system.is_connected_state():
        say(connected=bool(connected))


async def fly(port: str) -> None:
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=60.0)
        say(found=True)
        action, offboard, telemetry = ActionAsync(system), OffboardAsync(system), TelemetryAsync(system)
        watching = asyncio.ensure_future(watch(system))
        async for health in telemetry.subscribe_health():
            if health.is_armable:
                break
        while not await tried("arm", action.arm()):
            pass
        await offboard.set_velocity_body(FORWARD)
        while not watching.done():
            # MAVSDK has forgotten the set-point after a start without an answer.
            await offboard.set_velocity_body(FORWARD)
            await tried("offboard", offboard.start())
            await tried("rate", telemetry.set_rate_position(5.0))
            await asyncio.sleep(1.0)


if __name__ == "__main__":
    asyncio.run(fly(sys.argv[1]))
