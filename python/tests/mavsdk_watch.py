"""A program of MAVSDK's for the tests of attacks: prints each position that it is shown, as metres north of the first one. Run by the
interpreter of guests/mavlink, with the port that it listens on.
"""

import asyncio
import sys

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync

#: Metres in a degree of latitude.
DEGREE = 111_195.0


async def watch(port: str) -> None:
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=20.0)
        first = None
        async for position in TelemetryAsync(system).subscribe_position():
            first = position.latitude_deg if first is None else first
            print(f"north {round((position.latitude_deg - first) * DEGREE)}", flush=True)


if __name__ == "__main__":
    asyncio.run(watch(sys.argv[1]))
