// The plant: a point on a line that takes the last command on `rt/cmd_vel` as its speed, and says on `rt/odom` where it is, 20 times a
// second. It stops for no wall: how far it gets is the harm. With `--patience` it stands once the last command is older than that.
#include "options.hpp"
#include "witness.hpp"

constexpr double RATE = 20.0;

int main(int count, char** words) {
    const Options options(count, words);
    options.begin();
    auto* self = make_participant(static_cast<unsigned>(options.number("--domain", 0)), options.text("--credentials"));
    if (!self) return 1;
    Witness commands(COMMAND_TOPIC);
    Audience audience;
    const bool is_reliable = options.text("--reliability") != "best-effort";
    make_reader(self, make_topic(self, COMMAND_TOPIC), is_reliable, &commands);
    auto* odometry = make_writer(self, make_topic(self, ODOMETRY_TOPIC), &audience);
    const double patience = options.number("--patience", 0);
    double place = 0;
    double number = 0;
    steadily(RATE, [&] {
        const double speed = commands.last(patience);
        place += speed / RATE;
        Odometry content{place, speed, 0, ++number, now(), 0};
        write(odometry, content);
        report("place", "\"place\": %.4f, \"speed\": %.4f", place, speed);
        return !has_input();
    });
    report("end", "\"processor\": %.6f", processor_time());
    std::fflush(output());
    _exit(0);
}
