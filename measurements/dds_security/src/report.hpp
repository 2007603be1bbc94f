// Lines of JSON on standard output, each with the time of the machine's monotonic clock, which all processes of a run share.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <ctime>
#include <mutex>
#include <sstream>
#include <string>

#include <sys/resource.h>
#include <unistd.h>

#include <fastdds/rtps/common/Guid.h>

inline double now() {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The report has standard output for itself: lines of the library go to standard error.
inline FILE* output() {
    static FILE* const file = [] {
        FILE* own = fdopen(dup(STDOUT_FILENO), "w");
        dup2(STDERR_FILENO, STDOUT_FILENO);
        return own;
    }();
    return file;
}

// One line: {"t": ..., "event": ..., and the rest in the format of printf}.
[[gnu::format(printf, 2, 3)]] inline void report(const char* event, const char* format, ...) {
    static std::mutex lock;
    const std::lock_guard<std::mutex> guard(lock);
    std::fprintf(output(), "{\"t\": %.6f, \"event\": \"%s\", ", now(), event);
    va_list arguments;
    va_start(arguments, format);
    std::vfprintf(output(), format, arguments);
    va_end(arguments);
    std::fprintf(output(), "}\n");
}

// Twelve bytes of the participant and four of the endpoint, in hexadecimal.
inline std::string text(const eprosima::fastrtps::rtps::GUID_t& guid) {
    std::string result;
    char two[3];
    const auto append = [&](unsigned char byte) {
        std::snprintf(two, sizeof two, "%02x", byte);
        result += two;
    };
    for (unsigned char byte : guid.guidPrefix.value) append(byte);
    for (unsigned char byte : guid.entityId.value) append(byte);
    return result;
}

inline std::string hexadecimal(const void* bytes, size_t length) {
    std::string result;
    char two[3];
    for (size_t index = 0; index < length; ++index) {
        std::snprintf(two, sizeof two, "%02x", static_cast<const unsigned char*>(bytes)[index]);
        result += two;
    }
    return result;
}

// Processor time of this process so far, in seconds.
inline double processor_time() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& time) { return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec); };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}
