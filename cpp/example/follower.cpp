// Follower: pure pursuit along the route, as guests/follower/follower.py, to start a guest of your own from.
//
// Naive by intention: the newest fix is the place, and the last one stays the place when none comes any more.

#include "../holdsafe_guest.hpp"

#include <algorithm>
#include <limits>

using namespace holdsafe::guest;

namespace {

constexpr double LOOKAHEAD_S = 0.9, LEAST_M = 1.5, MOST_M = 4.0;
constexpr double MAX_CURVATURE = 0.4, SIDEWAYS = 1.2, COMFORT = 1.0;  // 1/m, m/s², m/s²
constexpr double REACHED_M = 0.8;

double between(Place a, Place b) { return std::hypot(b.east - a.east, b.north - a.north); }

class Follower : public Guest {
   public:
    void start(const Start& start) override {
        mission_ = start;
        ahead_ = start.route;
    }

    Reply step(const Step& step) override {
        if (step.fix) fix_ = step.fix;
        if (!fix_) return {0.0, 0.0, "WAITING", Place{}};
        const Place here = fix_->at;
        if (!ahead_.empty() && between(here, ahead_.front()) < REACHED_M) {
            if (mission_.looped) ahead_.push_back(ahead_.front());
            ahead_.erase(ahead_.begin());
        }
        if (ahead_.empty()) return {0.0, 0.0, "ARRIVED", here};
        const double curvature = pursue(here, fix_->yaw_rad, std::min(step.limit_m_s, mission_.max_speed_m_s));
        return {speed_, curvature, "DRIVING", here};
    }

   private:
    Start mission_;
    std::vector<Place> ahead_;
    std::optional<Fix> fix_;
    double speed_ = 0.0;

    /// Curvature of the arc through the point one lookahead along the way; sets the speed.
    double pursue(Place here, double yaw, double limit) {
        const double reach = std::clamp(speed_ * LOOKAHEAD_S, LEAST_M, MOST_M);
        double left = 0.0;
        std::optional<Place> carrot;
        Place at = here;
        for (const Place point : ahead_) {
            const double leg = between(at, point);
            if (!carrot && left + leg >= reach) {
                const double share = (reach - left) / leg;
                carrot = Place{at.east + share * (point.east - at.east), at.north + share * (point.north - at.north)};
            }
            left += leg;
            at = point;
        }
        const Place to = carrot.value_or(at);
        const double bearing = std::atan2(to.north - here.north, to.east - here.east) - yaw;
        double arc = 2.0 * std::sin(bearing) / between(here, to);
        if (std::cos(bearing) < 0.0) arc = std::copysign(MAX_CURVATURE, arc);
        const double curvature = std::clamp(arc, -MAX_CURVATURE, MAX_CURVATURE);
        const double slow = std::sqrt(SIDEWAYS / std::max(std::abs(curvature), 1e-9));
        const double stop = mission_.looped ? std::numeric_limits<double>::infinity() : std::sqrt(2.0 * COMFORT * left);
        speed_ = std::min({limit, slow, stop});
        return curvature;
    }
};

}  // namespace

int main() { return run<Follower>(); }
