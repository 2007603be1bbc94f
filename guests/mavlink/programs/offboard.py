"""Set-points with MAVSDK 4: arms, takes off, and flies along its nose in OFFBOARD.

    offboard.py PORT [SPEED [SECONDS]]
"""

import asyncio
import sys

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action.action import ActionAsync
from mavsdk.asyncio.plugins.offboard.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync
from mavsdk.plugins.offboard.offboard import VelocityBodyYawspeed


async def fly(port: str, speed: float, seconds: float) -> None:
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=20.0)
        action, offboard, telemetry = ActionAsync(system), OffboardAsync(system), TelemetryAsync(system)
        async for health in telemetry.subscribe_health():
            if health.is_armable:
                break
        await action.arm()
        await offboard.set_velocity_body(VelocityBodyYawspeed(speed, 0.0, 0.0, 0.0))
        await offboard.start()
        await asyncio.sleep(seconds)
        await offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0))
        await offboard.stop()
        await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(fly(sys.argv[1], *map(float, sys.argv[2:]), *[1.0, 1e6][len(sys.argv) - 2 :]))
