"""Conversions of the bridge to ROS 2, without ROS."""

import math
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "guests/ros2"))

import packet
from conversion import (
    FREE,
    MOST_CELLS,
    OCCUPIED,
    drive,
    geocentric,
    geodetic,
    grid,
    lost,
    outline,
    plan,
    quaternion,
    seconds,
    stamp,
    yaw,
)

SQUARE = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0)]


class Times(unittest.TestCase):
    def test_a_stamp_has_whole_seconds_and_nanoseconds(self) -> None:
        self.assertEqual(stamp(3600.05), (3600, 50_000_000))
        self.assertEqual(stamp(0.9999999), (1, 0))
        self.assertEqual(stamp(-0.25), (-1, 750_000_000))
        self.assertAlmostEqual(seconds(*stamp(12.345678)), 12.345678)


class Turns(unittest.TestCase):
    def test_north_is_a_quarter_turn(self) -> None:
        x, y, z, w = quaternion(math.pi / 2.0)
        self.assertEqual((x, y), (0.0, 0.0))
        self.assertAlmostEqual(z, math.sqrt(0.5))
        self.assertAlmostEqual(w, math.sqrt(0.5))

    def test_a_yaw_comes_back(self) -> None:
        for angle in (-3.1, -math.pi / 2.0, 0.0, 0.3, math.pi):
            self.assertAlmostEqual(yaw(quaternion(angle)), angle)


class Commands(unittest.TestCase):
    def test_a_turn_of_a_moving_vehicle_is_a_curvature(self) -> None:
        self.assertEqual(drive(2.0, 0.5), (2.0, 0.25))
        self.assertEqual(drive(2.0, -0.5), (2.0, -0.25))
        self.assertFalse(lost(2.0, 0.5))

    def test_to_the_left_in_reverse_is_a_curvature_to_the_right(self) -> None:
        self.assertEqual(drive(-1.0, 0.5), (-1.0, -0.5))

    def test_a_turn_on_the_spot_stands_and_is_lost(self) -> None:
        self.assertEqual(drive(0.0, 1.0), (0.0, 0.0))
        self.assertTrue(lost(0.0, 1.0))
        self.assertFalse(lost(0.0, 0.0))

    def test_a_sharper_turn_than_the_protocol_has_is_cut_and_lost(self) -> None:
        self.assertEqual(drive(0.01, -1.0), (0.01, -10.0))
        self.assertTrue(lost(0.01, -1.0))

    def test_what_is_no_number_stays_none(self) -> None:
        self.assertTrue(math.isnan(drive(math.nan, 0.0)[0]))


class Paths(unittest.TestCase):
    def test_a_pose_has_the_course_of_the_leg_from_it(self) -> None:
        poses = plan([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], False)
        self.assertEqual([at for at, _ in poses], [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
        self.assertEqual([course for _, course in poses], [0.0, math.pi / 2.0, math.pi / 2.0])

    def test_a_loop_ends_where_it_begins(self) -> None:
        self.assertEqual([at for at, _ in plan(SQUARE, True)], [*SQUARE, SQUARE[0]])

    def test_a_route_may_be_short(self) -> None:
        self.assertEqual(plan([], True), [])
        self.assertEqual(plan([(3.0, 4.0)], False), [((3.0, 4.0), 0.0)])


class Degrees(unittest.TestCase):
    ORIGIN = (47.0, 8.0, 400.0)

    def test_the_origin_is_itself(self) -> None:
        for got, expected in zip(geodetic((0.0, 0.0, 0.0), self.ORIGIN), self.ORIGIN):
            self.assertAlmostEqual(got, expected)

    def test_a_known_place_has_its_coordinates(self) -> None:
        # On the equator a second of arc is 30.92 m to the east and 30.72 m to the north.
        east, north = (geodetic(place, (0.0, 0.0, 0.0)) for place in ((30.92, 0.0, 0.0), (0.0, 30.715, 0.0)))
        self.assertAlmostEqual(east[1] * 3600.0, 1.0, places=3)
        self.assertAlmostEqual(north[0] * 3600.0, 1.0, places=3)

    def test_distances_are_kept(self) -> None:
        places = [(-900.0, 2000.0, 3.0), (1500.0, -700.0, 50.0)]
        a, b = (geocentric(geodetic(place, self.ORIGIN)) for place in places)
        self.assertAlmostEqual(math.dist(a, b), math.dist(*places), places=5)

    def test_height_grows_with_distance_along_the_plane(self) -> None:
        _, _, height = geodetic((0.0, 2000.0, 0.0), self.ORIGIN)
        self.assertAlmostEqual(height, 400.0 + 2000.0**2 / (2.0 * 6.37e6), places=2)


class Packets(unittest.TestCase):
    WRITER = bytes(range(16))

    def test_a_forged_packet_is_in_the_name_of_the_writer(self) -> None:
        for forged, kind in ((packet.heartbeat(self.WRITER), 0x07), (packet.data(self.WRITER), 0x15)):
            self.assertEqual((forged[:4], forged[8:20], forged[20]), (b"RTPS", self.WRITER[:12], kind))
            self.assertIn(self.WRITER[12:], forged[24:])
            self.assertEqual(int.from_bytes(forged[22:24], "little"), len(forged) - 24)

    def test_a_heartbeat_has_28_bytes_of_content(self) -> None:
        self.assertEqual(len(packet.heartbeat(self.WRITER)), 20 + 4 + 28)


class Maps(unittest.TestCase):
    def test_rows_go_east_from_the_south_west(self) -> None:
        made = grid(SQUARE, [((15.0, 2.0), (1.0, 0.5), 0.0)])
        self.assertEqual((made.origin, made.width, made.height), ((0.0, 0.0), 80, 40))
        self.assertEqual(len(made.cells), 80 * 40)
        self.assertEqual(made.at((15.0, 2.0)), OCCUPIED)
        self.assertEqual(made.at((2.0, 5.0)), FREE)
        self.assertEqual(made.at((15.0, 5.0)), FREE)

    def test_outside_the_fence_is_occupied(self) -> None:
        made = grid([(0.0, 0.0), (20.0, 0.0), (20.0, 10.0)], [])
        self.assertEqual(made.at((2.0, 8.0)), OCCUPIED)
        self.assertEqual(made.at((18.0, 2.0)), FREE)

    def test_a_block_thinner_than_a_cell_is_in_the_map(self) -> None:
        made = grid(SQUARE, [((10.0, 5.0), (3.0, 0.01), math.pi / 4.0)])
        for along in (-2.9, 0.0, 1.3, 2.9):
            self.assertEqual(made.at((10.0 + along * math.sqrt(0.5), 5.0 + along * math.sqrt(0.5))), OCCUPIED)

    def test_a_heading_turns_a_block(self) -> None:
        corners = outline(((0.0, 0.0), (2.0, 1.0), math.pi / 2.0))
        self.assertAlmostEqual(max(x for x, _ in corners), 1.0)
        self.assertAlmostEqual(max(y for _, y in corners), 2.0)

    def test_a_large_world_has_large_cells(self) -> None:
        made = grid([(-10_000.0, -10_000.0), (10_000.0, -10_000.0), (10_000.0, 10_000.0), (-10_000.0, 10_000.0)], [])
        self.assertLessEqual(len(made.cells), MOST_CELLS * 1.01)

    def test_without_a_fence_nothing_is_occupied_but_blocks(self) -> None:
        self.assertEqual(set(grid([], []).cells), {FREE})
        self.assertEqual(grid([], [((5.0, 5.0), (1.0, 1.0), 0.0)]).at((5.0, 5.0)), OCCUPIED)


if __name__ == "__main__":
    unittest.main()
