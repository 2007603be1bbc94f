// The reactive navigator of MRPT as a guest: it is given positions, point obstacles and way points, and gives speeds.
//
// Written from the headers of Debian's libmrpt-nav-dev 1:2.5.8+ds-2 (CRobot2NavInterface.h, CWaypointsNavigator.h, CAbstractNavigator.h,
// CAbstractPTGBasedReactive.h) and the class documentation at reference.mrpt.org. The library is unmodified; nothing of it judges its
// inputs here, and this adapter does not either: a fix is passed on as it comes, with its stamp.
//
// - Time is the vehicle's clock, through mrpt::Clock's simulated source and getNavigationTime().
// - Discs of the map and tracks become rings of points; the fence and teammates are not passed on: the navigator has no notion of them.
// - A missing fix is "false" from getCurrentPoseAndSpeeds, the interface's own word for it.
// - Driving begins with the first fix and an operator's permission; without permission the navigator is suspended, and resumed with it.
//
// Observed with python/tests/driver.py, a point with exact sensors, the attack from 4 s on (one run each, and a second one with the
// same answers byte for byte; in python/: python3 -m tests.driver --seconds 60 --attack A -- ../guests/mrpt/mrpt-guest
// ../guests/mrpt/reactive.ini):
// - none: 20.0 m to the goal, IDLE from 10.95 s. With `--mission blocked`, a disc on the way: around it, IDLE from 11.10 s.
// - freeze (the fix repeats itself, odometry goes on): drives on for 30.1 s and 60.7 m at 2 m/s, past the goal, in NAVIGATING. Then
//   the navigator's own alarm "not approaching the target", 30 s by default, ends in NAV_ERROR and a stop.
// - drift (0.5 m/s to the north): follows it, and is IDLE, its goal reached, 8.8 m beside the goal.
// - dropout (no fix): NAV_ERROR and a stop at the first step without one.

#include <mrpt/config/CConfigFile.h>
#include <mrpt/core/Clock.h>
#include <mrpt/kinematics/CVehicleVelCmd_DiffDriven.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/nav/reactive/CReactiveNavigationSystem.h>

#include <algorithm>

#include "../../cpp/holdsafe_guest.hpp"

namespace {

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

/// Distance between the points of a ring, m, and the fewest of them.
constexpr double RING_M = 0.2;
constexpr int RING_LEAST = 8;
/// Distance at which a way point counts as reached, and the last one, m.
constexpr double REACHED_M = 1.0, ARRIVED_M = 0.5;
/// Slowest speed that has a curvature, m/s.
constexpr double CREEP = 0.01;

/// Radius of the disc that stands for a track, m: half the diagonal of a car, a person with arms.
double radius_of(const std::string& class_name) {
    if (class_name == "person") return 0.5;
    return class_name == "other" ? 1.0 : 2.3;
}

mrpt::system::TTimeStamp stamp(double seconds) { return mrpt::Clock::fromDouble(seconds); }

/// The robot as the navigator sees it: the newest step's contents, and the last command.
class Robot : public mrpt::nav::CRobot2NavInterface {
   public:
    Start mission;
    Step step;
    TPose2D odometry;
    double v = 0.0, w = 0.0;

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
        for (const Disc& disc : mission.obstacles) ring(points, disc);
        for (const auto& track : step.tracks) ring(points, {track.at, radius_of(track.class_name)});
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
    double getNavigationTime() override { return step.time_s - mission.time_s; }
    void resetNavigationTimer() override {}

   private:
    /// Points around a disc, in the frame of the fix.
    void ring(mrpt::maps::CSimplePointsMap& points, const Disc& disc) const {
        const TPose2D here(step.fix->at.east, step.fix->at.north, step.fix->yaw_rad);
        const int count = std::max(RING_LEAST, static_cast<int>(std::ceil(2.0 * M_PI * disc.radius_m / RING_M)));
        for (int i = 0; i < count; ++i) {
            const double angle = 2.0 * M_PI * i / count;
            const mrpt::math::TPoint2D point(disc.at.east + disc.radius_m * std::cos(angle),
                                             disc.at.north + disc.radius_m * std::sin(angle));
            const mrpt::math::TPoint2D local = here.inverseComposePoint(point);
            points.insertPoint(static_cast<float>(local.x), static_cast<float>(local.y), 0.0f);
        }
    }
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
        robot_.mission = start;
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
        const bool ended = begun_ && robot_.mission.looped && state == CAbstractNavigator::IDLE;
        if (permitted && robot_.step.fix && !robot_.mission.route.empty() && (!begun_ || ended)) {
            begun_ = true;
            navigator_.navigateWaypoints(way());
        } else if (!permitted && state == CAbstractNavigator::NAVIGATING) {
            navigator_.suspend();
            robot_.stop(false);
        } else if (permitted && state == CAbstractNavigator::SUSPENDED) {
            navigator_.resume();
        }
    }

    mrpt::nav::TWaypointSequence way() const {
        mrpt::nav::TWaypointSequence way;
        const auto& route = robot_.mission.route;
        for (std::size_t i = 0; i < route.size(); ++i) {
            const bool last = i + 1 == route.size() && !robot_.mission.looped;
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
