"""A mission with MAVSDK 4: arms, takes off, flies the route, and holds at its end. It knows no part of holdsafe but the route's file.

    mission.py PORT ROUTE
"""

import asyncio
import json
import sys

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action.action import ActionAsync
from mavsdk.asyncio.plugins.mission.mission import MissionAsync
from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync
from mavsdk.plugins.mission.mission import MissionItem, MissionPlan


async def fly(port: str, file: str) -> None:
    with open(file, encoding="utf-8") as opened:
        route = json.load(opened)
    given = {"relative_altitude_m": route["relative_altitude_m"], "speed_m_s": route["max_speed_m_s"], "acceptance_radius_m": 1.0}
    items = [MissionItem(**point, **given, is_fly_through=True) for point in route["points"]]
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=20.0)
        action, mission, telemetry = ActionAsync(system), MissionAsync(system), TelemetryAsync(system)
        await mission.upload_mission(MissionPlan(items))
        async for health in telemetry.subscribe_health():
            if health.is_armable:
                break
        await action.arm()
        if route["medium"] == "air":
            await action.takeoff()
            async for in_air in telemetry.subscribe_in_air():
                if in_air:
                    break
        await mission.start_mission()
        async for progress in mission.subscribe_mission_progress():
            if progress.current == progress.total:
                break
        await action.hold()
        # The vehicle needs another end.
        await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(fly(sys.argv[1], sys.argv[2]))
