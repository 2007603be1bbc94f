"""Parameters of the vehicle, by the names of PX4 or of ArduPilot, and their values. The messages are left to `parameter_messages`."""

import math
from dataclasses import dataclass
from typing import Optional

#: MAV_PARAM_TYPE.
INT32, REAL32 = 6, 9


@dataclass(frozen=True)
class Row:
    """One parameter: its meaning, its names, and the range of the vehicle's value."""

    meaning: str
    px4: str
    ardupilot: str
    least: float
    most: float
    whole: bool = False
    #: ArduPilot's value of the vehicle's 1.
    scale: float = 1.0


#: Speeds m/s, lengths m, times s. `data_link_act`: 0 goes on, 1 holds, 2 returns, 3 lands.
ROWS = [
    Row("cruise", "MPC_XY_CRUISE", "WPNAV_SPEED", 0.1, 20.0, scale=100.0),
    Row("take_off_height", "MIS_TAKEOFF_ALT", "PILOT_TKOFF_ALT", 0.5, 100.0, scale=100.0),
    Row("radius", "NAV_ACC_RAD", "WPNAV_RADIUS", 0.1, 50.0, scale=100.0),
    Row("return_height", "RTL_RETURN_ALT", "RTL_ALT", 0.0, 100.0, scale=100.0),
    Row("off_board_limit", "COM_OF_LOSS_T", "GUID_TIMEOUT", 0.1, 60.0),
    Row("data_link_act", "NAV_DLL_ACT", "FS_GCS_ENABLE", 0.0, 3.0, whole=True),
    Row("data_link_limit", "COM_DL_LOSS_T", "FS_GCS_TIMEOUT", 1.0, 300.0, whole=True),
    Row("system", "MAV_SYS_ID", "SYSID_THISMAV", 1.0, 1.0, whole=True),
]


class Parameters:
    """The table with its values, by the names of one autopilot."""

    def __init__(self, ardupilot: bool, cruise_m_s: float, height_m: Optional[float]) -> None:
        self.ardupilot = ardupilot
        height = height_m or 2.5
        # The limits of time of PX4 v1.15 and of ArduPilot 4.5; a radius that fits a body of half a metre.
        self.values = {
            "cruise": cruise_m_s,
            "take_off_height": height,
            "radius": 1.0,
            "return_height": height,
            "off_board_limit": 3.0 if ardupilot else 1.0,
            "data_link_act": 0.0,
            "data_link_limit": 10.0,
            "system": 1.0,
        }
        self.rows = {self.name(row): row for row in ROWS}
        self.names = list(self.rows)

    def name(self, row: Row) -> str:
        return row.ardupilot if self.ardupilot else row.px4

    def __getitem__(self, meaning: str) -> float:
        return self.values[meaning]

    def shown(self, name: str) -> Optional[float]:
        """The value as the autopilot would show it; None without such a parameter."""
        row = self.rows.get(name)
        return None if row is None else self.values[row.meaning] * self.scale(row)

    def scale(self, row: Row) -> float:
        return row.scale if self.ardupilot else 1.0

    def kind(self, name: str) -> int:
        return INT32 if self.rows[name].whole else REAL32

    def change(self, name: str, shown: float) -> bool:
        """Takes a value as the autopilot would show it; False where it is none of the parameter's."""
        row = self.rows.get(name)
        if row is None or not math.isfinite(shown):
            return False
        value = shown / self.scale(row)
        value = float(round(value)) if row.whole else value
        if not row.least <= value <= row.most:
            return False
        self.values[row.meaning] = value
        return True
