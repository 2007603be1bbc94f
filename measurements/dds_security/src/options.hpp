// Options of the three programs as `--name value`, and standard input: a line each for "go" and the end.
#pragma once

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>
#include <thread>

#include <poll.h>
#include <unistd.h>

#include "report.hpp"

class Options {
public:
    Options(int count, char** words) {
        for (int index = 1; index + 1 < count; index += 2) values_[words[index]] = words[index + 1];
    }
    // With `--lines yes` each line of the report leaves at once; otherwise the report waits in a buffer and costs little.
    void begin() const {
        if (!text("--lines").empty()) std::setvbuf(output(), nullptr, _IOLBF, 0);
        report("start", "\"process\": %d", getpid());
    }
    std::string text(const std::string& name) const {
        const auto found = values_.find(name);
        return found == values_.end() ? "" : found->second;
    }
    double number(const std::string& name, double otherwise) const {
        const auto found = values_.find(name);
        return found == values_.end() ? otherwise : std::atof(found->second.c_str());
    }

private:
    std::map<std::string, std::string> values_;
};

// True once standard input has a line or its end.
inline bool has_input() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    return poll(&input, 1, 0) > 0;
}

// Calls `act` at a steady rate until it returns false.
template <typename Act>
void steadily(double rate, Act act) {
    using Clock = std::chrono::steady_clock;
    const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / rate));
    for (auto next = Clock::now(); act(); std::this_thread::sleep_until(next)) next += period;
}
