// The rogue: waits for a line on standard input, then writes `--count` messages at `--rate` on `--topic`, or listens to it with
// `--listen yes`. A negative count marks its messages.
#include "options.hpp"
#include "witness.hpp"

// Faster than the node ever drives; as odometry, a place that the plant never reaches.
constexpr double COMMAND = 1.5;
constexpr double PLACE = -5.0;

int main(int count, char** words) {
    const Options options(count, words);
    options.begin();
    auto* self = make_participant(static_cast<unsigned>(options.number("--domain", 0)), options.text("--credentials"));
    if (!self) return 1;
    const std::string name = options.text("--topic");
    auto* where = make_topic(self, name);
    Witness witness(name);
    Audience audience;
    const bool is_listener = !options.text("--listen").empty();
    auto* heard = is_listener ? make_reader(self, where, true, &witness) : nullptr;
    auto* sender = is_listener ? nullptr : make_writer(self, where, &audience);
    if (!heard && !sender) return 2;
    std::string line;
    std::getline(std::cin, line);
    double number = 0;
    const double most = options.number("--count", 0);
    steadily(options.number("--rate", 20), [&] {
        if (sender && number < most) {
            ++number;
            Doubles<6> content{name == COMMAND_TOPIC ? COMMAND : PLACE, 0, 0, -number, now(), 0};
            write(sender, content);
        }
        return !has_input();
    });
    report("end", "\"processor\": %.6f", processor_time());
    std::fflush(output());
    _exit(0);
}
