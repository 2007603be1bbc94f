"""The vehicle behind MAVLink without MAVLink: its state, guidance, missions and parameters."""

import json
import math
import sys
import unittest
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "guests/mavlink"))

from geodesy import Globe
from guidance import STAND, Motion
from holdsafe_guest import Origin, Start, Step
from holdsafe_guest.reading import request
from modes import ArduPilotModes, Asked, Mode, Px4Modes
from parameters import Parameters
from plan import LOITER, SPEED, WAYPOINT, Item, Plan
from route import waypoints_of
from vehicle import Result, SetPoint, Vehicle

from .mavlink_core import FASTEST, HEIGHT, PERIOD, ROUTE, Body, start_of, step_of

NAN = float("nan")


def parsed(message: dict[str, Any]) -> Any:
    return request(json.dumps(message).encode())


class Flown:
    """A vehicle and the body that follows it."""

    def __init__(self, rotors: bool = True, ardupilot: bool = False) -> None:
        start: Start = parsed(start_of(rotors, ROUTE))
        self.said: list[str] = []
        parameters = Parameters(ardupilot, FASTEST, HEIGHT if rotors else None)
        self.vehicle = Vehicle(start, parameters, ardupilot, self.said.append)
        self.body, self.number = Body(rotors), 0

    def step(self, limit: float = FASTEST, fix: bool = True) -> Motion:
        self.number += 1
        step: Step = parsed(step_of(self.number, self.body, limit, {"fix": fix}))
        self.vehicle.read(step)
        motion = self.vehicle.motion()
        velocity = {"forward_m_s": motion.forward, "left_m_s": motion.left, "up_m_s": motion.up, "turn_rad_s": motion.turn}
        self.body.follow({"velocity": velocity}, limit)
        return motion

    def fly(self, seconds: float, **given: Any) -> Motion:
        motion = STAND
        for _ in range(round(seconds / PERIOD)):
            motion = self.step(**given)
        return motion

    def armed(self) -> "Flown":
        self.step()
        assert self.vehicle.arm() is Result.ACCEPTED
        return self

    def up(self) -> "Flown":
        self.armed().vehicle.take_off(None)
        self.step()
        return self

    def set_point(self, **given: Any) -> None:
        self.vehicle.take_set_point(SetPoint(self.vehicle.now_s, **given))


def way(*points: tuple[float, float], hold_s: float = 0.0) -> list[Item]:
    return [Item(WAYPOINT, (hold_s, 1.0, 0.0, NAN), 3, 1, 1, HEIGHT, at=at, height_m=HEIGHT) for at in points]


class Arming(unittest.TestCase):
    def test_it_needs_the_operator_and_a_position(self) -> None:
        flown = Flown()
        flown.step(limit=0.0)
        self.assertIs(flown.vehicle.arm(), Result.DENIED)
        flown.fly(2.0, fix=False)
        self.assertIs(flown.vehicle.arm(), Result.DENIED)
        flown.step()
        self.assertIs(flown.vehicle.arm(), Result.ACCEPTED)

    def test_a_vehicle_that_is_not_armed_stands(self) -> None:
        flown = Flown()
        flown.step()
        flown.vehicle.plan.replace(way((10.0, 0.0)))
        self.assertIs(flown.vehicle.change_mode(Asked(Mode.MISSION)), Result.ACCEPTED)
        self.assertEqual(flown.fly(1.0), STAND)

    def test_it_stays_armed_in_the_air_unless_forced(self) -> None:
        flown = Flown().up()
        self.assertIs(flown.vehicle.disarm(forced=False), Result.DENIED)
        self.assertIs(flown.vehicle.disarm(forced=True), Result.ACCEPTED)

    def test_the_operators_hold_stops_each_mode(self) -> None:
        for mode in (Mode.MISSION, Mode.GOTO, Mode.OFFBOARD, Mode.RTL, Mode.LAND):
            with self.subTest(mode):
                flown = Flown().up()
                flown.vehicle.enter(mode)
                self.assertEqual(flown.step(limit=0.0), STAND)
                self.assertIs(flown.vehicle.mode, Mode.HOLD)


class Flights(unittest.TestCase):
    def test_a_take_off_at_height_is_over_at_once(self) -> None:
        flown = Flown().up()
        self.assertIs(flown.vehicle.mode, Mode.HOLD)
        self.assertFalse(flown.vehicle.landed)

    def test_a_climb_that_stalls_is_over(self) -> None:
        flown = Flown().armed()
        flown.vehicle.take_off(30.0)
        flown.body.height = HEIGHT
        for _ in range(200):
            flown.step()
            flown.body.height = HEIGHT
        self.assertIs(flown.vehicle.mode, Mode.HOLD)

    def test_a_goal_is_met_and_held(self) -> None:
        for rotors in (True, False):
            with self.subTest(rotors=rotors):
                flown = Flown(rotors).armed()
                self.assertIs(flown.vehicle.go_to((9.0, 4.0), 5.0 if rotors else None, None), Result.ACCEPTED)
                flown.fly(20.0)
                self.assertLess(math.dist((flown.body.x, flown.body.y), (9.0, 4.0)), 0.7)
                self.assertAlmostEqual(flown.body.height, 5.0 if rotors else HEIGHT, delta=0.2)

    def test_a_return_lands_at_home(self) -> None:
        flown = Flown().up()
        flown.vehicle.go_to((9.0, 4.0), None, None)
        flown.fly(8.0)
        flown.vehicle.change_mode(Asked(Mode.RTL))
        flown.fly(30.0)
        self.assertEqual((flown.vehicle.armed, flown.vehicle.landed), (False, True))
        self.assertLess(math.hypot(flown.body.x, flown.body.y), 1.5)
        self.assertLess(flown.body.height, 0.3)

    def test_a_mission_ends_in_hold(self) -> None:
        flown = Flown().up()
        speed = Item(SPEED, (1.0, 1.0, 0.0, 0.0), 2, 0, 0, NAN)
        flown.vehicle.plan.replace([*way((5.0, 0.0)), speed, *way((5.0, 5.0))])
        flown.vehicle.change_mode(Asked(Mode.MISSION))
        flown.fly(3.5)
        self.assertLessEqual(math.hypot(flown.body.forward, flown.body.left), 1.01)
        flown.fly(10.0)
        self.assertIs(flown.vehicle.mode, Mode.HOLD)
        self.assertEqual(flown.vehicle.plan.reached, [0, 1, 2])

    def test_a_mission_without_items_is_denied(self) -> None:
        self.assertIs(Flown().up().vehicle.change_mode(Asked(Mode.MISSION)), Result.DENIED)

    def test_wheels_never_go_sideways(self) -> None:
        flown = Flown(rotors=False).armed()
        for given in ({"velocity": (0.0, 2.0)}, {"velocity": (1.0, 1.0), "of_body": True}, {"at": (-4.0, 3.0)}):
            flown.set_point(**given)
            flown.vehicle.change_mode(Asked(Mode.OFFBOARD))
            motion = flown.step()
            self.assertEqual((motion.left, motion.up), (0.0, 0.0))
            self.assertLessEqual(abs(motion.curvature()), 0.4001)

    def test_a_velocity_is_along_the_named_axes(self) -> None:
        flown = Flown().up()
        flown.body.yaw = math.pi / 2.0
        flown.step()
        for of_body, expected in ((False, (0.0, -2.0)), (True, (2.0, 0.0))):
            flown.set_point(velocity=(2.0, 0.0), of_body=of_body)
            flown.vehicle.change_mode(Asked(Mode.OFFBOARD))
            motion = flown.vehicle.motion()
            self.assertAlmostEqual(motion.forward, expected[0], places=2)
            self.assertAlmostEqual(motion.left, expected[1], places=2)


class Failsafes(unittest.TestCase):
    def off_board(self, ardupilot: bool = False) -> Flown:
        flown = Flown(ardupilot=ardupilot).up()
        flown.set_point(velocity=(1.0, 0.0))
        flown.vehicle.change_mode(Asked(Mode.HOLD, guided=True) if ardupilot else Asked(Mode.OFFBOARD))
        flown.set_point(velocity=(1.0, 0.0))
        flown.step()
        return flown

    def test_off_board_needs_set_points_first(self) -> None:
        self.assertIs(Flown().up().vehicle.change_mode(Asked(Mode.OFFBOARD)), Result.DENIED)

    def test_set_points_end_by_the_vehicles_clock(self) -> None:
        flown = self.off_board()
        self.assertGreater(flown.fly(0.9).forward, 0.9)
        self.assertEqual(flown.fly(0.3), STAND)
        self.assertTrue(flown.vehicle.failsafe)
        flown.set_point(velocity=(1.0, 0.0))
        self.assertEqual(flown.step(), STAND)

    def test_guided_stands_and_takes_set_points_again(self) -> None:
        flown = self.off_board(ardupilot=True)
        self.assertIs(flown.vehicle.mode, Mode.OFFBOARD)
        self.assertEqual(flown.fly(3.2), STAND)
        self.assertFalse(flown.vehicle.failsafe)
        flown.set_point(velocity=(1.0, 0.0))
        self.assertGreater(flown.step().forward, 0.5)

    def test_a_lost_position_stands(self) -> None:
        flown = self.off_board()
        for _ in range(30):
            flown.set_point(velocity=(1.0, 0.0))
            motion = flown.step(fix=False)
        self.assertEqual((motion, flown.vehicle.failsafe), (STAND, True))


class Numbers(unittest.TestCase):
    def test_px4_reads_its_own_modes(self) -> None:
        numbers = Px4Modes()
        for mode in Mode:
            asked = numbers.from_number(numbers.number(mode, guided=False))
            self.assertEqual(asked, Asked(Mode.HOLD if mode is Mode.GOTO else mode))
        self.assertIsNone(numbers.from_command(9.0, 9.0))

    def test_ardupilot_has_guided(self) -> None:
        for rover, guided in ((False, 4), (True, 15)):
            numbers = ArduPilotModes(rover)
            self.assertEqual(numbers.from_number(guided), Asked(Mode.HOLD, guided=True))
            self.assertEqual(numbers.number(Mode.OFFBOARD, True), guided)
            self.assertEqual(numbers.number(Mode.HOLD, True), guided)
            self.assertNotEqual(numbers.number(Mode.HOLD, False), guided)

    def test_a_parameter_takes_values_of_its_range(self) -> None:
        parameters = Parameters(True, FASTEST, HEIGHT)
        self.assertEqual(parameters.shown("WPNAV_SPEED"), 300.0)
        for value, taken in ((200.0, True), (NAN, False), (math.inf, False), (-1.0, False), (1e9, False)):
            self.assertEqual(parameters.change("WPNAV_SPEED", value), taken)
        self.assertEqual(parameters["cruise"], 2.0)
        self.assertFalse(parameters.change("MPC_XY_CRUISE", 1.0))

    def test_a_place_survives_the_way_to_degrees(self) -> None:
        globe = Globe(Origin(47.4, 8.5, 488.0))
        for place in ((0.0, 0.0), (100.0, -250.0), (-4000.0, 3000.0)):
            self.assertLess(math.dist(globe.place(*globe.degrees(place)), place), 1e-6)
            latitude, longitude = globe.units(place)
            self.assertLess(math.dist(globe.place(latitude / 1e7, longitude / 1e7), place), 0.02)

    def test_a_degree_of_latitude_is_the_ellipsoids(self) -> None:
        # By the ellipsoid, a degree of latitude at 45° is 111,132 m, one of longitude 78,847 m.
        east, north = Globe(Origin(45.0, 0.0, 0.0)).metres_per_degree()
        self.assertAlmostEqual(north, 111_132.0, delta=5.0)
        self.assertAlmostEqual(east, 78_847.0, delta=5.0)

    def test_way_points_begin_at_home(self) -> None:
        start: Start = parsed(start_of(True, ROUTE))
        assert start.origin is not None
        lines = waypoints_of(start, Globe(start.origin)).splitlines()
        self.assertEqual((lines[0], len(lines)), ("QGC WPL 110", 5))
        self.assertEqual([line.split("\t")[3] for line in lines[1:]], ["16", "16", "16", str(LOITER)])


class Plans(unittest.TestCase):
    def test_a_new_mission_goes_on_at_its_index(self) -> None:
        plan = Plan(way((1.0, 0.0), (2.0, 0.0)), current=1)
        plan.replace(way((1.0, 5.0), (2.0, 5.0)))
        item = plan.item()
        assert item is not None
        self.assertEqual(item.at, (2.0, 5.0))
        plan.replace(way((3.0, 0.0)))
        self.assertEqual(plan.current, 0)

    def test_ardupilots_home_is_never_flown(self) -> None:
        plan = Plan(first=1)
        plan.replace(way((0.0, 0.0), (2.0, 0.0)))
        self.assertEqual(plan.current, 1)
        plan.complete()
        plan.restart_if_finished()
        self.assertEqual(plan.current, 1)

    def test_numbers_that_are_none_hold_nothing(self) -> None:
        item = Item(WAYPOINT, (NAN, NAN, NAN, NAN), 3, 1, 1, 3.0)
        self.assertEqual((item.hold_s(), item.radius_m(2.0)), (0.0, 2.0))


if __name__ == "__main__":
    unittest.main()
