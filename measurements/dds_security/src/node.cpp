// The node: drives the plant to a goal by the odometry on `rt/odom`, and stays there. It starts with its first match, so that no command
// is sent before there is a reader.
#include <algorithm>

#include "options.hpp"
#include "witness.hpp"

constexpr double GAIN = 0.8;
constexpr double FASTEST = 1.0;

int main(int count, char** words) {
    const Options options(count, words);
    options.begin();
    auto* self = make_participant(static_cast<unsigned>(options.number("--domain", 0)), options.text("--credentials"));
    if (!self) return 1;
    Witness odometry(ODOMETRY_TOPIC);
    Audience audience;
    make_reader(self, make_topic(self, ODOMETRY_TOPIC), true, &odometry);
    auto* commands = make_writer(self, make_topic(self, COMMAND_TOPIC), &audience);
    const double goal = options.number("--goal", 6);
    const double most = options.number("--count", 0);
    double number = 0;
    bool is_started = false;
    steadily(options.number("--rate", 20), [&] {
        is_started = is_started || (audience.is_matched() && odometry.is_matched());
        if (is_started && (most == 0 || number < most)) {
            const double speed = std::clamp(GAIN * (goal - odometry.last(0)), -FASTEST, FASTEST);
            Twist content{speed, 0, 0, ++number, now(), 0};
            write(commands, content);
        }
        return !has_input();
    });
    report("end", "\"processor\": %.6f", processor_time());
    std::fflush(output());
    _exit(0);
}
