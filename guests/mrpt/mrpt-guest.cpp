// The reactive navigator of MRPT as a guest: it is given positions, point obstacles and way points, and gives speeds.
//
// Written from the headers of Debian's libmrpt-nav-dev 1:2.5.8+ds-2 (CRobot2NavInterface.h, CWaypointsNavigator.h, CAbstractNavigator.h,
// CAbstractPTGBasedReactive.h) and the class documentation at reference.mrpt.org. The library is unmodified; nothing of it judges its
// inputs here, and this adapter does not either: a fix is passed on as it comes, with its stamp.
//
// - Time is the vehicle's clock, through mrpt::Clock's simulated source and getNavigationTime().
// - Blocks of the map become points along their edges (of a core that tells none, its discs rings of points), and tracks rings of points;
//   a track on a block is that block. The fence and teammates are not passed on: the navigator has no notion of them.
// - A missing fix is "false" from getCurrentPoseAndSpeeds, the interface's own word for it.
// - Driving begins with the first fix and an operator's permission; without permission the navigator is suspended, and resumed with it.
//
// Observed with python/tests/driver.py, a point with exact sensors, the attack from 4 s on (one run each, and a second one with the
// same answers byte for byte; in python/: python3 -m tests.driver --seconds 60 --attack A -- ../guests/mrpt/mrpt-guest
// ../guests/mrpt/reactive.ini):
// - none: 20.0 m to the goal, IDLE from 10.95 s. With `--mission blocked`, a disc on the way: around it, IDLE from 11.10 s.
// - freeze (the fix repeats itself, odometry goes on): drives on for 30.1 s and 60.7 m at 2 m/s, past the goal, in NAVIGATING. Then
//   the navigator's own alarm "not approaching the target", 30 s by default, ends in NAV_ERROR and a stop.
// - drift (0.5 m/s to the north): follows it, and is IDLE, its goal reached, 8.6 m beside the goal.
// - dropout (no fix): NAV_ERROR and a stop at the first step without one.

#include <mrpt/config/CConfigFile.h>
#include <mrpt/core/Clock.h>
#include <mrpt/kinematics/CVehicleVelCmd_DiffDriven.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/nav/reactive/CReactiveNavigationSystem.h>

#include <algorithm>

#include "../../cpp/holdsafe_guest.hpp"

namespace {

using holdsafe::guest::Block;
using holdsafe::guest::Disc;
using holdsafe::guest::Fix;
using holdsafe::guest::Odometry;
using holdsafe::guest::Place;
using holdsafe::guest::Reply;
using holdsafe::guest::Start;
using holdsafe::guest::Step;
using mrpt::kinematics::CVehicleVelCmd;
using mrpt::kinematics::CVehicleVelCmd_DiffDriven;
using mrpt::math::TPose2D;
using mrpt::nav::CAbstractNavigator;

/// Largest distance between points along an edge or a ring, m, and the fewest of a ring.
constexpr double SPACING_M = 0.2;
constexpr int RING_LEAST = 8;
/// Distance beyond which no path leads, m: refDistance of the parameters with the body.
constexpr double FAR_M = 10.0;
/// Distance from a block at which a track is taken for it, m.
constexpr double SAME_M = 0.5;
/// Distance from a block at which no goal is set, m: half the body's length and its margin.
constexpr double CLEAR_M = 1.5;
/// Distance at which a way point counts as reached, and the last one, m.
constexpr double REACHED_M = 1.0, ARRIVED_M = 0.5;
/// Longest leg, m, as long as the paths: a goal far beyond them tells them hardly apart.
constexpr double LEG_M = 8.0;
/// Slowest speed that has a curvature, m/s.
constexpr double CREEP = 0.01;

/// Radius of the disc that stands for a track, m: half the diagonal of a car, a person with arms.
double radius_of(const std::string& class_name) {
    if (class_name == "person") return 0.5;
    return class_name == "other" ? 1.0 : 2.3;
}

mrpt::system::TTimeStamp stamp(double seconds) { return mrpt::Clock::fromDouble(seconds); }

/// A place of the block's own frame, its length along the first axis, in the world.
Place in_world(const Block& block, double along, double across) {
    const double c = std::cos(block.heading_rad), s = std::sin(block.heading_rad);
    return {block.at.east + c * along - s * across, block.at.north + s * along + c * across};
}

/// True if the place is on the block or within a distance of it, m.
bool near_block(const Block& block, const Place& place, double within) {
    const double east = place.east - block.at.east, north = place.north - block.at.north;
    const double c = std::cos(block.heading_rad), s = std::sin(block.heading_rad);
    return std::abs(c * east + s * north) < block.half_length_m + within &&
           std::abs(c * north - s * east) < block.half_width_m + within;
}

/// Points along the edges of a block.
void outline(std::vector<Place>& points, const Block& block) {
    const double length = block.half_length_m, width = block.half_width_m;
    const int along = std::max(1, static_cast<int>(std::ceil(2.0 * length / SPACING_M)));
    const int across = std::max(1, static_cast<int>(std::ceil(2.0 * width / SPACING_M)));
    for (int i = 0; i <= along; ++i) {
        for (const double side : {-width, width}) points.push_back(in_world(block, length * (2.0 * i / along - 1.0), side));
    }
    for (int i = 1; i < across; ++i) {
        for (const double end : {-length, length}) points.push_back(in_world(block, end, width * (2.0 * i / across - 1.0)));
    }
}

/// Points around a disc.
void ring(std::vector<Place>& points, const Disc& disc) {
    const int count = std::max(RING_LEAST, static_cast<int>(std::ceil(2.0 * M_PI * disc.radius_m / SPACING_M)));
    for (int i = 0; i < count; ++i) {
        const double angle = 2.0 * M_PI * i / count;
        points.push_back({disc.at.east + disc.radius_m * std::cos(angle), disc.at.north + disc.radius_m * std::sin(angle)});
    }
}

/// The robot as the navigator sees it: the newest step's contents, and the last command.
class Robot : public mrpt::nav::CRobot2NavInterface {
   public:
    Step step;
    TPose2D odometry;
    double v = 0.0, w = 0.0;

    const Start& mission() const { return mission_; }

    void begin(const Start& start) {
        mission_ = start;
        for (const Block& block : start.blocks) outline(map_, block);
        if (start.blocks.empty()) {
            for (const Disc& disc : start.obstacles) ring(map_, disc);
        }
    }

    /// True within a distance of a block of the map, m.
    bool known(const Place& place, double within) const {
        const auto near = [&](const Block& block) { return near_block(block, place, within); };
        return std::any_of(mission_.blocks.begin(), mission_.blocks.end(), near);
    }

    /// Takes the step, and adds its odometry to the way so far.
    void take(const Step& next) {
        if (next.odometry && step.odometry && next.odometry->stamp_s > step.odometry->stamp_s) {
            const double dt = next.odometry->stamp_s - step.odometry->stamp_s;
            odometry.phi += next.odometry->yaw_rate_rad_s * dt;
            odometry.x += next.odometry->speed_m_s * dt * std::cos(odometry.phi);
            odometry.y += next.odometry->speed_m_s * dt * std::sin(odometry.phi);
        }
        step = next;
    }

    bool getCurrentPoseAndSpeeds(TPose2D& pose, mrpt::math::TTwist2D& velocity, mrpt::system::TTimeStamp& at,
                                 TPose2D& raw, std::string&) override {
        if (!step.fix) return false;
        const Fix& fix = *step.fix;
        const Odometry wheels = step.odometry.value_or(Odometry{});
        pose = TPose2D(fix.at.east, fix.at.north, fix.yaw_rad);
        velocity = mrpt::math::TTwist2D(wheels.speed_m_s * std::cos(fix.yaw_rad), wheels.speed_m_s * std::sin(fix.yaw_rad),
                                        wheels.yaw_rate_rad_s);
        at = stamp(fix.stamp_s);
        raw = odometry;
        return true;
    }

    bool senseObstacles(mrpt::maps::CSimplePointsMap& points, mrpt::system::TTimeStamp& at) override {
        points.clear();
        at = stamp(step.time_s);
        if (!step.fix) return false;
        std::vector<Place> seen;
        for (const auto& track : step.tracks) {
            if (!known(track.at, SAME_M)) ring(seen, {track.at, radius_of(track.class_name)});
        }
        const TPose2D here(step.fix->at.east, step.fix->at.north, step.fix->yaw_rad);
        for (const auto* places : {&map_, &seen}) {
            for (const Place& place : *places) {
                const mrpt::math::TPoint2D local = here.inverseComposePoint({place.east, place.north});
                if (std::hypot(local.x, local.y) > FAR_M) continue;
                points.insertPoint(static_cast<float>(local.x), static_cast<float>(local.y), 0.0f);
            }
        }
        return true;
    }

    bool changeSpeeds(const CVehicleVelCmd& command) override {
        const auto* drive = dynamic_cast<const CVehicleVelCmd_DiffDriven*>(&command);
        if (!drive) return false;
        v = drive->lin_vel;
        w = drive->ang_vel;
        return true;
    }

    bool stop(bool) override {
        v = w = 0.0;
        return true;
    }

    CVehicleVelCmd::Ptr getEmergencyStopCmd() override { return getStopCmd(); }
    CVehicleVelCmd::Ptr getStopCmd() override { return CVehicleVelCmd::Ptr(new CVehicleVelCmd_DiffDriven()); }
    double getNavigationTime() override { return step.time_s - mission_.time_s; }
    void resetNavigationTimer() override {}

   private:
    Start mission_;
    /// Points of the map's blocks, in the world.
    std::vector<Place> map_;
};

const char* name(CAbstractNavigator::TState state) {
    switch (state) {
        case CAbstractNavigator::IDLE: return "IDLE";
        case CAbstractNavigator::NAVIGATING: return "NAVIGATING";
        case CAbstractNavigator::SUSPENDED: return "SUSPENDED";
        case CAbstractNavigator::NAV_ERROR: return "NAV_ERROR";
    }
    throw std::logic_error("a state that MRPT 2.5.8 does not have");
}

class Navigator : public holdsafe::guest::Guest {
   public:
    explicit Navigator(std::string parameters) : parameters_(std::move(parameters)) {}

    void start(const Start& start) override {
        clock(start.time_s);
        robot_.begin(start);
        robot_.setMinLoggingLevel(mrpt::system::LVL_WARN);
        navigator_.setMinLoggingLevel(mrpt::system::LVL_WARN);
        navigator_.loadConfigFile(mrpt::config::CConfigFile(parameters_));
        navigator_.initialize();
    }

    Reply step(const Step& step) override {
        clock(step.time_s);
        robot_.take(step);
        if (step.fix) place_ = step.fix->at;
        permit(step.limit_m_s > 0.0);
        navigate();
        const double v = std::clamp(robot_.v, -step.limit_m_s, step.limit_m_s);
        const double curvature = std::abs(robot_.v) < CREEP ? 0.0 : std::clamp(robot_.w / robot_.v, -10.0, 10.0);
        return {v, curvature, name(navigator_.getCurrentState()), place_};
    }

   private:
    std::string parameters_;
    Robot robot_;
    mrpt::nav::CReactiveNavigationSystem navigator_{robot_, false, false};
    /// The pose given last.
    Place place_;
    bool begun_ = false;

    static void clock(double seconds) {
        mrpt::Clock::setSimulatedTime(stamp(seconds));
        mrpt::Clock::setActiveClock(mrpt::Clock::Simulated);
    }

    /// One step of the navigator. Without a pose it stops the robot, enters NAV_ERROR and throws, once a step.
    void navigate() {
        try {
            navigator_.navigationStep();
        } catch (const std::exception&) {
            if (navigator_.getCurrentState() != CAbstractNavigator::NAV_ERROR) throw;
        }
    }

    /// Begins, suspends or resumes the navigation as the operator permits; a looped route begins anew at its end.
    void permit(bool permitted) {
        const auto state = navigator_.getCurrentState();
        const bool ended = begun_ && robot_.mission().looped && state == CAbstractNavigator::IDLE;
        if (permitted && robot_.step.fix && !robot_.mission().route.empty() && (!begun_ || ended)) {
            begun_ = true;
            navigator_.navigateWaypoints(way());
        } else if (!permitted && state == CAbstractNavigator::NAVIGATING) {
            navigator_.suspend();
            robot_.stop(false);
        } else if (permitted && state == CAbstractNavigator::SUSPENDED) {
            navigator_.resume();
        }
    }

    /// The route. Points between on long legs may be skipped.
    mrpt::nav::TWaypointSequence way() const {
        mrpt::nav::TWaypointSequence way;
        const auto& route = robot_.mission().route;
        Place from = place_;
        for (std::size_t i = 0; i < route.size(); ++i) {
            const double east = route[i].east - from.east, north = route[i].north - from.north;
            const int legs = std::max(1, static_cast<int>(std::ceil(std::hypot(east, north) / LEG_M)));
            for (int leg = 1; leg < legs; ++leg) {
                const Place between{from.east + east * leg / legs, from.north + north * leg / legs};
                if (robot_.known(between, CLEAR_M)) continue;
                way.waypoints.emplace_back(between.east, between.north, REACHED_M, true, std::nullopt, 1.0);
            }
            from = route[i];
            const bool last = i + 1 == route.size() && !robot_.mission().looped;
            way.waypoints.emplace_back(route[i].east, route[i].north, last ? ARRIVED_M : REACHED_M, false, std::nullopt,
                                       last ? 0.0 : 1.0);
        }
        return way;
    }
};

}  // namespace

int main(int count, char** words) {
    if (count != 2) {
        std::cerr << "usage: mrpt-guest PARAMETERS.ini\n";
        return 2;
    }
    return holdsafe::guest::run([&] { return std::make_unique<Navigator>(words[1]); });
}
