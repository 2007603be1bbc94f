// Checks of the header. Without arguments: its reader, its writer and its loop. With two files: answers against a transcript's.

#include "exchange.hpp"

#include <fstream>
#include <limits>

namespace {

struct Probe : Guest {
    Reply reply;
    explicit Probe(Reply reply) : reply(std::move(reply)) {}
    void start(const Start& start) override {
        if (start.blocks.empty()) return;
        const Block& block = start.blocks[0];
        expect(block.at.north == -2.5 && block.half_width_m == 0.3 && block.heading_rad == -1.5, "the start's block");
    }
    Reply step(const Step& step) override {
        expect(step.fix && step.fix->at.east == 1.5 && step.fix->yaw_rad == -0.5 && !step.odometry, "the step's navigation");
        expect(step.tracks.at(0).id == 7 && step.tracks[0].class_name == "person", "the step's tracks");
        expect(step.teammates.at(0).north == 5.0 && step.number == 1 && step.mode == "READY", "the step's other fields");
        return reply;
    }
};

/// The answers to these lines, or the error.
std::string served(const std::string& lines, const Reply& reply = {0.5, -0.1}) {
    std::istringstream requests(lines);
    std::ostringstream answers;
    try {
        serve([&] { return std::make_unique<Probe>(reply); }, requests, answers);
    } catch (const std::exception& error) {
        return error.what();
    }
    return answers.str();
}

void wrong_lines_are_refused_by_name() {
    const std::pair<std::string, std::string> cases[] = {
        {"", "expected at byte 1"},
        {"[1]", "an object with one field"},
        {std::string(60000, '['), "nesting of at most 16"},
        {"{\"stop\":{}}", "`start` or `step` expected, got `stop`"},
        {"{\"step\":1}", "step: an object expected, got a number"},
        {with(STEP, "mode", "mood"), "step: the field `mode` is missing"},
        {with(STEP, "\"number\":1", "\"number\":1.5"), "step.number: a whole number"},
        {with(STEP, "\"number\":1", "\"number\":01"), "leading zeros"},
        {with(STEP, "3600.05", "NaN"), "a value expected"},
        {with(STEP, "3600.05", "1e999"), "range of a double"},
        {with(STEP, "3600.05", "1."), "a digit expected"},
        {with(STEP, "[1.5,0]", "[1.5]"), "step.fix.at: [east, north] expected"},
        {with(STEP, "READY", "\\ud800"), "a pair of surrogates"},
        {with(STEP, "READY", "\\q"), "an escape expected"},
        {STEP + "x", "the end of the line expected"},
        {STEP.substr(0, STEP.size() - 1), "`,` or `}`"},
        {with(START, "jsonl/1", "jsonl/3"), "protocol jsonl/1 or jsonl/2 expected, got jsonl/3"},
        {with(START, "0.5", "null"), "start.obstacles[0].radius_m: a number expected, got null"},
        {with(START, "[0.5,0.3]", "[0.5]"), "start.blocks[0].half_m: [length, width] expected"},
        {std::string(MAX_LINE, ' '), "at most 65536 bytes"},
    };
    for (const auto& [line, message] : cases) {
        const std::string got = served(START + "\n" + line + "\n");
        expect(got.rfind("line 2: ", 0) == 0 && got.find(message) != std::string::npos, message + " / " + got.substr(0, 120));
    }
    expect(served(STEP + "\n").find("line 1: `start` expected, got `step`") == 0, "a step before the start");
}

void replies_are_written_whole_and_within_range() {
    const std::string both = START + "\n" + STEP + "\n";
    const std::string short_reply = READY + "{\"reply\":{\"number\":1,\"speed_m_s\":0.5,\"curvature_per_m\":-0.1}}\n";
    expect(served(both) == short_reply, "a short reply");
    expect(served(with(both, "\"blocks\"", "\"later\"")) == short_reply, "a start without blocks");
    const Reply whole{1e-7, 0.0, "a\"\\\n", Place{1.0, -2.5}, 0.25};
    const std::string rest = R"("speed_m_s":1e-07,"curvature_per_m":0,"state":"a\"\\\u000a","place":[1,-2.5],"wake_s":0.25}})";
    expect(served(both, whole) == READY + "{\"reply\":{\"number\":1," + rest + "\n", served(both, whole));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Reply wrong[] = {{nan, 0.0}, {101.0, 0.0}, {0.0, -11.0}, {0.0, 0.0, {}, Place{1e9, 0.0}}, {0.0, 0.0, {}, {}, 1.5}};
    for (const Reply& reply : wrong) expect(served(both, reply).find("expected, got") != std::string::npos, "a value out of range");
}

/// Every line cut short or with one byte changed is answered or refused, and never crashes.
void damaged_lines_never_crash() {
    std::uint32_t state = 1;
    for (int i = 0; i < 20000; ++i) {
        state = state * 1664525u + 1013904223u;
        std::string line = i % 2 == 0 ? START + "\n" + STEP : START_2 + "\n" + STEP_2;
        line[(state >> 8) % line.size()] = static_cast<char>(state >> 3);
        if (i % 3 == 0) line.resize((state >> 4) % line.size());
        std::istringstream requests(line);
        std::ostringstream answers;
        try {
            struct Deaf : Guest {
                Reply step(const Step&) override { return {}; }
            };
            serve([] { return std::make_unique<Deaf>(); }, requests, answers);
        } catch (const ProtocolError&) {
        }
    }
    ++passed;
}

bool alike(const detail::Value& a, const detail::Value& b) {
    if (a.kind != b.kind || a.names != b.names || a.items.size() != b.items.size() || a.text != b.text) return false;
    if (std::abs(a.number - b.number) > 1e-9 || a.truth != b.truth) return false;
    for (std::size_t i = 0; i < a.items.size(); ++i) {
        if (!alike(a.items[i], b.items[i])) return false;
    }
    return true;
}

/// Answers in `answers` against every second line of `transcript`, numbers to a billionth.
void answers_are_as_recorded(const char* answers, const char* transcript) {
    std::ifstream got(answers), recorded(transcript);
    std::string request, line, answer;
    for (int pair = 0; std::getline(recorded, request) && std::getline(recorded, line); ++pair) {
        const bool there = static_cast<bool>(std::getline(got, answer));
        const bool right = there && alike(detail::Reader(line).whole(), detail::Reader(answer).whole());
        expect(right, "pair " + std::to_string(pair) + ": " + line + " expected, got " + answer);
    }
    expect(passed > 1 && !std::getline(got, answer), "as many answers as requests");
}

}  // namespace

int main(int count, char** words) {
    if (count == 3) {
        answers_are_as_recorded(words[1], words[2]);
    } else {
        wrong_lines_are_refused_by_name();
        replies_are_written_whole_and_within_range();
        damaged_lines_never_crash();
    }
    return counted();
}
