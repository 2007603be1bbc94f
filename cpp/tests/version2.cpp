// Checks of what version 2 adds: its fields, its set-point, its refusals, and starts that come again.

#include "exchange.hpp"

#include <limits>

namespace {

bool same(Place a, double east, double north) { return a.east == east && a.north == north; }

void version_two_is_read_whole() {
    const Exchange got = exchanged(START_2 + "\n" + STEP_2 + "\n");
    expect(got.refused.empty() && got.seen.starts.size() == 1 && got.seen.steps.size() == 1, "version 2: " + got.refused);
    if (failed) return;
    const Start& start = got.seen.starts[0];
    expect(start.protocol == "jsonl/2" && start.time_s == 3600.0 && start.period_s == 0.05, "the start's protocol and times");
    expect(start.max_speed_m_s == 3.0 && start.braking_m_s2 == 2.5 && start.looped, "the start's vehicle");
    expect(same(start.route.at(0), 1.0, 2.0) && same(start.fence.at(0), 3.0, 4.0), "the start's route and fence");
    expect(same(start.obstacles.at(0).at, 5.0, 6.0) && start.blocks.at(0).half_length_m == 0.5, "the start's obstacles");
    expect(start.pose && same(start.pose->at, 7.0, 8.0) && start.pose->yaw_rad == 0.5 && start.pose->height_m == 2.5, "the pose");
    const Body body = start.body.value_or(Body());
    expect(body.medium == "air" && body.length_m == 0.5 && body.width_m == 0.4, "the body's medium and size");
    expect(body.max_curvature_per_m == 0.45 && body.max_reverse_m_s == 1.0, "the body's limits on the ground");
    expect(body.max_climb_m_s == 0.8 && body.cruise_height_m == 2.6, "the body's limits in the air");
    const Origin origin = start.origin.value_or(Origin());
    expect(origin.latitude_deg == 47.0 && origin.longitude_deg == 8.0 && origin.height_m == 400.0, "the origin");
    const Step& step = got.seen.steps[0];
    expect(step.number == 1 && step.limit_m_s == 2.0 && step.height_m == 2.45, "the step's height");
    expect(step.fix && step.fix->receiver_s == 9.0 && step.fix->height_m == 2.4, "the fix's height");
    expect(step.odometry && step.odometry->yaw_rate_rad_s == 0.3, "the odometry");
    expect(step.odometry && step.odometry->left_m_s == 0.2 && step.odometry->up_m_s == -0.1, "the odometry's left and up");
    expect(step.tracks.at(0).updated_s == 3.0 && step.tracks[0].sigma_m == 0.25, "the track's deviation");
    expect(step.nearby && step.nearby->size() == 1, "one thing nearby");
    const Nearby nearby = step.nearby ? step.nearby->at(0) : Nearby();
    expect(nearby.id == 3 && same(nearby.at, 9.0, 1.0) && same(nearby.velocity, 0.0, 1.2) && nearby.width_m == 0.35, "nearby");
}

void fields_without_a_value_are_none() {
    const auto none = [](const Exchange& got, const std::string& what) {
        expect(got.refused.empty() && got.seen.steps.size() == 1, what + ": " + got.refused);
        if (got.seen.steps.empty()) return;
        const Start& start = got.seen.starts[0];
        const Step& step = got.seen.steps[0];
        expect(!start.pose && !start.body && !start.origin && !step.height_m && !step.nearby, what + ": a field of version 2");
        expect(step.fix && !step.fix->height_m && !step.tracks.at(0).sigma_m, what + ": a height or deviation");
    };
    none(exchanged(START + "\n" + STEP + "\n"), "version 1");
    const std::string start = with(START, "\"blocks\"", R"("pose":null,"body":null,"origin":null,"blocks")");
    std::string step = with(STEP, "\"teammates\"", R"("height_m":null,"nearby":null,"teammates")");
    step = with(with(step, "\"updated_s\"", R"("sigma_m":null,"updated_s")"), "\"receiver_s\"", R"("height_m":null,"receiver_s")");
    none(exchanged(with(start, "jsonl/1", "jsonl/2") + "\n" + step + "\n"), "null");
    const std::string ground = with(with(START_2, ",\"height_m\":2.5", ""), "\"air\"", "\"ground\"");
    const Exchange got = exchanged(ground + "\n" + with(STEP, "\"teammates\"", R"("nearby":[],"teammates")") + "\n");
    expect(got.seen.starts.at(0).pose && !got.seen.starts[0].pose->height_m, "a pose on the ground");
    expect(got.seen.steps.at(0).nearby && got.seen.steps[0].nearby->empty(), "LiDAR that shows nothing");
    expect(exchanged(START + "\n").seen.starts.at(0).protocol == "jsonl/1", "the protocol of version 1");
}

/// A velocity with these values in the order of its fields.
Reply moving(double forward, double left, double up, double turn) {
    Reply reply;
    reply.velocity = Velocity{forward, left, up, turn};
    return reply;
}

void velocity_stands_in_place_of_speed_and_curvature() {
    const std::string both = START_2 + "\n" + STEP_2 + "\n";
    Reply reply = moving(1.5, -0.5, 0.25, 0.125);
    const std::string velocity =
        R"({"reply":{"number":1,"velocity":{"forward_m_s":1.5,"left_m_s":-0.5,"up_m_s":0.25,"turn_rad_s":0.125})";
    expect(exchanged(both, reply).answers == READY + velocity + "}}\n", "a velocity alone");
    reply.speed_m_s = 2.0;
    reply.state = "GO";
    reply.place = Place{1.0, 2.0};
    reply.wake_s = 0.25;
    const std::string rest = R"(,"state":"GO","place":[1,2],"wake_s":0.25}})";
    expect(exchanged(both, reply).answers == READY + velocity + rest + "\n", "a velocity with the other fields");
    reply.velocity.reset();
    const std::string course = R"({"reply":{"number":1,"speed_m_s":2,"curvature_per_m":0)";
    expect(exchanged(both, reply).answers == READY + course + rest + "\n", "speed and curvature in version 2");
}

void each_part_of_a_velocity_has_its_range() {
    const std::string both = START_2 + "\n" + STEP_2 + "\n";
    for (const double sign : {1.0, -1.0}) {
        const Exchange most = exchanged(both, moving(100.0 * sign, 100.0 * sign, 100.0 * sign, 10.0 * sign));
        expect(most.own.empty() && most.answers.size() > READY.size(), "the ends of the ranges: " + most.own);
    }
    const char* const names[] = {"forward_m_s: ", "left_m_s: ", "up_m_s: ", "turn_rad_s: "};
    const double infinite = std::numeric_limits<double>::infinity();
    for (int part = 0; part < 4; ++part) {
        const double beyond = std::nextafter(part == 3 ? 10.0 : 100.0, infinite);
        for (const double value : {beyond, -beyond, infinite, std::numeric_limits<double>::quiet_NaN()}) {
            double parts[] = {0.0, 0.0, 0.0, 0.0};
            parts[part] = value;
            const Exchange got = exchanged(both, moving(parts[0], parts[1], parts[2], parts[3]));
            expect(got.own.rfind(names[part], 0) == 0 && got.own.find("expected, got") != std::string::npos, names[part] + got.own);
            expect(got.answers == READY, "nothing out of range is written");
        }
    }
    Reply unsent = moving(1.0, 0.0, 0.0, 0.0);
    unsent.curvature_per_m = 11.0;
    expect(exchanged(both, unsent).own.rfind("curvature_per_m: ", 0) == 0, "a value that is not sent has its range too");
}

void another_protocol_is_refused_by_name() {
    for (const std::string name : {"jsonl/3", "jsonl/22", "jsonl/", "JSONL/2", "jsonl/2 "}) {
        const Exchange got = exchanged(with(START_2, "jsonl/2", name) + "\n");
        expect(got.refused == "line 1: protocol jsonl/1 or jsonl/2 expected, got " + name, got.refused);
        expect(got.seen.made == 0 && got.answers.empty(), "no guest for another protocol");
    }
    const std::string lengthy = exchanged(with(START_2, "jsonl/2", std::string(1000, 'j')) + "\n").refused;
    expect(lengthy.size() < 120, "forty characters of a name at most");
    expect(exchanged(with(START_2, "\"jsonl/2\"", "2") + "\n").refused == "line 1: start.protocol: a text expected, got a number",
           "a protocol by number");
}

void hostile_lines_of_version_two_end_by_name() {
    const std::string nested = std::string(20, '[') + std::string(20, ']');
    const std::pair<std::string, std::string> cases[] = {
        {with(START_2, "{\"at\":[7.0,8.0],", "{"), "start.pose: the field `at` is missing"},
        {with(START_2, "[7.0,8.0]", "[7.0]"), "start.pose.at: [east, north] expected"},
        {with(START_2, "\"height_m\":2.5", "\"height_m\":[]"), "start.pose.height_m: a number expected, got a list"},
        {with(START_2, "\"body\":{", "\"body\":[],\"b\":{"), "start.body: an object expected, got a list"},
        {with(START_2, "\"air\"", "3"), "start.body.medium: a text expected, got a number"},
        {with(START_2, "[0.5,0.4]", "[0.5,0.4,0.3]"), "start.body.size_m: [length, width] expected"},
        {with(START_2, "cruise_height_m", "cruise"), "start.body: the field `cruise_height_m` is missing"},
        {with(START_2, "47.0", "\"47\""), "start.origin.latitude_deg: a number expected, got a text"},
        {with(START_2, "longitude_deg", "longitude"), "start.origin: the field `longitude_deg` is missing"},
        {with(STEP_2, "2.45", "true"), "step.height_m: a number expected, got a truth value"},
        {with(STEP_2, "2.45", "-Infinity"), "a value expected"},
        {with(STEP_2, "2.45", "1e400"), "range of a double"},
        {with(STEP_2, "2.4}", "\"high\"}"), "step.fix.height_m: a number expected, got a text"},
        {with(STEP_2, "\"left_m_s\":0.2", "\"left_m_s\":{}"), "step.odometry.left_m_s: a number expected, got an object"},
        {with(STEP_2, "\"up_m_s\":-0.1", "\"up_m_s\":[1]"), "step.odometry.up_m_s: a number expected, got a list"},
        {with(STEP_2, "0.25}", "[0.25]}"), "step.tracks[0].sigma_m: a number expected, got a list"},
        {with(STEP_2, "\"nearby\":[", "\"nearby\":{},\"n\":["), "step.nearby: a list expected, got an object"},
        {with(STEP_2, "\"nearby\":[", "\"nearby\":[null,"), "step.nearby[0]: an object expected, got null"},
        {with(STEP_2, "\"id\":3", "\"id\":4294967296"), "step.nearby[0].id: a whole number of 32 bits"},
        {with(STEP_2, "\"id\":3", "\"id\":-1"), "step.nearby[0].id: a whole number of 32 bits"},
        {with(STEP_2, "[0.0,1.2]", "[0.0,\"1.2\"]"), "step.nearby[0].velocity: a number expected, got a text"},
        {with(STEP_2, "width_m", "width"), "step.nearby[0]: the field `width_m` is missing"},
        {with(STEP_2, "\"bus\":[", "\"bus\":[" + nested + ","), "nesting of at most 16"},
        {with(STEP_2, "\"clock\"", "\"" + std::string(MAX_LINE, 'c') + "\""), "at most 65536 bytes"},
    };
    for (const auto& [line, message] : cases) {
        const Exchange got = exchanged(START_2 + "\n" + line + "\n");
        const bool named = got.refused.rfind("line 2: ", 0) == 0 && got.refused.find(message) != std::string::npos;
        expect(named, message + " / " + got.refused);
        expect(got.answers == READY, "no answer to a hostile line: " + message);
    }
    for (const std::string& whole : {START_2, STEP_2}) {
        for (std::size_t bytes = 1; bytes < whole.size(); ++bytes) {
            const Exchange got = exchanged(START_2 + "\n" + whole.substr(0, bytes));
            expect(got.refused.rfind("line 2: a line of JSON expected: ", 0) == 0, "a line cut at " + std::to_string(bytes));
        }
    }
}

void each_start_makes_a_guest_of_its_own() {
    const Exchange got = exchanged(START_2 + "\n" + STEP_2 + "\n" + START + "\n" + STEP + "\n" + START_2 + "\n" + START_2 + "\n");
    expect(got.refused.empty() && got.seen.made == 4 && got.seen.starts.size() == 4, "a guest for each start: " + got.refused);
    expect(got.seen.most_alive == 1 && got.seen.alive == 0, "one guest at a time");
    if (got.seen.starts.size() != 4 || got.seen.steps.size() != 2) return expect(false, "four starts and two steps");
    expect(got.seen.starts[0].body && !got.seen.starts[1].body && got.seen.starts[2].body, "each start by its own fields");
    expect(got.seen.steps[0].nearby && !got.seen.steps[1].nearby, "each step by its own fields");
}

}  // namespace

int main() {
    version_two_is_read_whole();
    fields_without_a_value_are_none();
    velocity_stands_in_place_of_speed_and_curvature();
    each_part_of_a_velocity_has_its_range();
    another_protocol_is_refused_by_name();
    hostile_lines_of_version_two_end_by_name();
    each_start_makes_a_guest_of_its_own();
    return counted();
}
