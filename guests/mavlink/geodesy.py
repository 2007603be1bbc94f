"""Places of the world frame as degrees on the ellipsoid WGS84, and back.

The world is flat and at most some kilometres wide: degrees are taken in proportion, by the radii of curvature at the origin. Within
10 km of it that differs from the ellipsoid by less than a permille; both directions use the same radii, so a place survives the way
there and back.
"""

import math
from dataclasses import dataclass

from holdsafe_guest import Origin, Place

#: Half of the longest axis, m, and the square of the eccentricity.
AXIS, ECCENTRICITY2 = 6_378_137.0, 6.694379990141316e-3
#: Units of a degree in integer fields of MAVLink.
UNITS = 1e7


def on_earth(latitude_deg: float, longitude_deg: float) -> bool:
    """True for degrees that a place can have."""
    return abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0


@dataclass(frozen=True)
class Globe:
    """The world's origin on the ellipsoid."""

    origin: Origin

    def metres_per_degree(self) -> tuple[float, float]:
        """Of longitude and latitude."""
        latitude = math.radians(self.origin.latitude_deg)
        root = 1.0 - ECCENTRICITY2 * math.sin(latitude) ** 2
        north = AXIS * (1.0 - ECCENTRICITY2) / root**1.5
        east = AXIS / math.sqrt(root) * math.cos(latitude)
        return math.radians(east), math.radians(north)

    def degrees(self, at: Place) -> tuple[float, float]:
        """Latitude and longitude of a place."""
        east, north = self.metres_per_degree()
        return self.origin.latitude_deg + at[1] / north, self.origin.longitude_deg + at[0] / east

    def units(self, at: Place) -> tuple[int, int]:
        """The same in integer fields."""
        latitude, longitude = self.degrees(at)
        return round(latitude * UNITS), round(longitude * UNITS)

    def place(self, latitude_deg: float, longitude_deg: float) -> Place:
        """The place of a latitude and a longitude."""
        east, north = self.metres_per_degree()
        return (longitude_deg - self.origin.longitude_deg) * east, (latitude_deg - self.origin.latitude_deg) * north
