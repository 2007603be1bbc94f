// One exchange of lines with a guest that keeps what it is told; the lines of both versions, and the count of the checks.
#pragma once

#include "../holdsafe_guest.hpp"

#include <algorithm>
#include <sstream>

using namespace holdsafe::guest;

inline int failed = 0;
inline int passed = 0;

inline void expect(bool right, const std::string& what) {
    ++(right ? passed : failed);
    if (!right) std::cerr << "failed: " << what << "\n";
}

/// The status to end with, after a line with the numbers.
inline int counted() {
    std::cout << passed << " passed, " << failed << " failed\n";
    return failed == 0 ? 0 : 1;
}

inline const std::string START =
    R"({"start":{"protocol":"jsonl/1","time_s":3600,"period_s":0.05,"max_speed_m_s":3.0,"braking_m_s2":3.0,"route":[[1,2]],)"
    R"("looped":false,"fence":[],"obstacles":[{"at":[1e1,-2.5],"radius_m":0.5}],)"
    R"("blocks":[{"at":[1e1,-2.5],"half_m":[0.5,0.3],"heading_rad":-1.5}]}})";
inline const std::string STEP =
    R"({"step":{"number":1,"time_s":3600.05,"limit_m_s":3.0,"mode":"READY","fix":{"stamp_s":3600.05,"at":[1.5,0],"yaw_rad":-0.5,)"
    R"("sigma_m":0.04,"receiver_s":3600.05},"odometry":null,"tracks":[{"id":7,"class":"person","at":[1,2],"velocity":[0.5,0],)"
    R"("confidence":0.9,"updated_s":3600}],"teammates":[[4,5]],"later":{"ignored":[true,false,null]}}})";

/// As the core writes them: every field of version 2, and an order to an adapter.
inline const std::string START_2 =
    R"({"start":{"protocol":"jsonl/2","time_s":3600.0,"period_s":0.05,"max_speed_m_s":3.0,"braking_m_s2":2.5,"route":[[1.0,2.0]],)"
    R"("looped":true,"fence":[[3.0,4.0]],"obstacles":[{"at":[5.0,6.0],"radius_m":0.5}],)"
    R"("blocks":[{"at":[5.0,6.0],"half_m":[0.5,0.3],"heading_rad":-1.5}],"pose":{"at":[7.0,8.0],"yaw_rad":0.5,"height_m":2.5},)"
    R"("body":{"medium":"air","size_m":[0.5,0.4],"max_curvature_per_m":0.45,"max_reverse_m_s":1.0,"max_climb_m_s":0.8,)"
    R"("cruise_height_m":2.6},"origin":{"latitude_deg":47.0,"longitude_deg":8.0,"height_m":400.0}}})";
inline const std::string STEP_2 =
    R"({"step":{"number":1,"time_s":3600.05,"limit_m_s":2.0,"mode":"READY","fix":{"stamp_s":1.0,"at":[1.5,0.1],"yaw_rad":-0.5,)"
    R"("sigma_m":0.04,"receiver_s":9.0,"height_m":2.4},"odometry":{"stamp_s":2.0,"speed_m_s":1.1,"yaw_rate_rad_s":0.3,)"
    R"("left_m_s":0.2,"up_m_s":-0.1},"tracks":[{"id":7,"class":"person","at":[1.0,2.0],"velocity":[0.5,0.0],"confidence":0.9,)"
    R"("updated_s":3.0,"sigma_m":0.25}],"teammates":[[4.0,5.0]],"height_m":2.45,)"
    R"("nearby":[{"id":3,"at":[9.0,1.0],"velocity":[0.0,1.2],"width_m":0.35}],)"
    R"("bus":[{"id":1,"attack":"clock","rate_hz":20.0,"amount":5.0}]}})";
inline const std::string READY = "{\"ready\":{}}\n";

/// A text with the first `from` replaced, which it must have.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

/// What guests were told, by all of them.
struct Seen {
    std::vector<Start> starts;
    std::vector<Step> steps;
    int made = 0, alive = 0, most_alive = 0;
};

struct Keeper : Guest {
    Seen& seen;
    Reply reply;
    Keeper(Seen& seen, Reply reply) : seen(seen), reply(std::move(reply)) {
        ++seen.made;
        seen.most_alive = std::max(seen.most_alive, ++seen.alive);
    }
    ~Keeper() override { --seen.alive; }
    void start(const Start& start) override { seen.starts.push_back(start); }
    Reply step(const Step& step) override {
        seen.steps.push_back(step);
        return reply;
    }
};

/// One exchange: the answers, and the error that ended it.
struct Exchange {
    std::string answers, refused, own;
    Seen seen;
};

inline Exchange exchanged(const std::string& lines, const Reply& reply = {0.5, -0.1}) {
    Exchange out;
    std::istringstream requests(lines);
    std::ostringstream answers;
    try {
        serve([&] { return std::make_unique<Keeper>(out.seen, reply); }, requests, answers);
    } catch (const ProtocolError& error) {
        out.refused = error.what();
    } catch (const std::exception& error) {
        out.own = error.what();
    }
    out.answers = answers.str();
    return out;
}
