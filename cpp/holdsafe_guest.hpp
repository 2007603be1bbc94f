// Guests of holdsafe in C++17: the messages of the protocols `jsonl/1` and `jsonl/2`, and the loop that answers them. One header,
// no dependencies.
//
// World frame: x east, y north, metres; angles counter-clockwise from east, radians; times in seconds of the vehicle's clock, which
// has an arbitrary zero. Fields that a request has beyond these are ignored. A guest of version 1 serves version 2 unchanged: the
// fields that version 2 adds are the last of each message. Needs POSIX (dup2), and <charconv> with floating point: GCC 11, Clang 20
// with libc++.
//
//     struct Careful : holdsafe::guest::Guest {
//         Reply step(const Step& step) override { return {std::min(1.0, step.limit_m_s), 0.0}; }
//     };
//     int main() { return holdsafe::guest::run<Careful>(); }
//
// Licence: MIT OR Apache-2.0.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace holdsafe::guest {

/// The versions of the protocol that this header speaks.
inline constexpr std::string_view PROTOCOLS[] = {"jsonl/1", "jsonl/2"};
/// The first of them, by the name that guests of version 1 may use.
inline constexpr std::string_view PROTOCOL = PROTOCOLS[0];
/// Longest line in either direction, bytes, its end included.
inline constexpr std::size_t MAX_LINE = 64 * 1024;

/// A line that is no message of the protocol: expected and got.
struct ProtocolError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// East and north, m.
struct Place {
    double east = 0.0;
    double north = 0.0;
};

/// A disc to keep clear of.
struct Disc {
    Place at;
    double radius_m = 0.0;
};

/// An obstacle by its length and width.
struct Block {
    /// Its middle.
    Place at;
    /// Half of length and width, m.
    double half_length_m = 0.0, half_width_m = 0.0;
    /// Direction of its length, rad.
    double heading_rad = 0.0;
};

/// A pose as surveyed.
struct StartPose {
    Place at;
    /// Heading, rad.
    double yaw_rad = 0.0;
    /// Height above the ground, m; none on the ground.
    std::optional<double> height_m = std::nullopt;
};

/// Measures of the vehicle's body.
struct Body {
    /// `ground`, `air` or `space`.
    std::string medium;
    /// Length and width, m; 0 for a line of sight.
    double length_m = 0.0, width_m = 0.0;
    /// Greatest curvature, 1/m.
    double max_curvature_per_m = 0.0;
    /// Greatest speed backwards, m/s.
    double max_reverse_m_s = 0.0;
    /// Greatest climb, m/s; 0 on the ground.
    double max_climb_m_s = 0.0;
    /// Height that is flown at, m; 0 on the ground.
    double cruise_height_m = 0.0;
};

/// A geodetic place, WGS 84.
struct Origin {
    /// Latitude and longitude, degrees.
    double latitude_deg = 0.0, longitude_deg = 0.0;
    /// Height above the ellipsoid, m.
    double height_m = 0.0;
};

/// The mission and its surroundings, told once.
struct Start {
    /// Time of the vehicle's clock, s.
    double time_s = 0.0;
    /// Time between two steps, unless the guest asks for a longer one, s.
    double period_s = 0.0;
    /// Largest speed of the vehicle, m/s.
    double max_speed_m_s = 0.0;
    /// Deceleration that the vehicle is sure to reach, m/s².
    double braking_m_s2 = 0.0;
    /// Way points in order; none to stand.
    std::vector<Place> route;
    /// True if the last way point leads to the first again.
    bool looped = false;
    /// Corners of the area that must not be left, in order.
    std::vector<Place> fence;
    /// Obstacles on the map as discs that reach to their ends, the first 64.
    std::vector<Disc> obstacles;
    /// The same obstacles by length and width; empty from a core that does not tell them.
    std::vector<Block> blocks;
    /// Pose at the start, as surveyed; none in version 1.
    std::optional<StartPose> pose = std::nullopt;
    /// The vehicle's body; none in version 1.
    std::optional<Body> body = std::nullopt;
    /// Geodetic place of the world frame's origin; none in version 1.
    std::optional<Origin> origin = std::nullopt;
    /// Version of the protocol, one of PROTOCOLS.
    std::string protocol{};
};

/// A position fix.
struct Fix {
    /// Time at which it was taken, s.
    double stamp_s = 0.0;
    Place at;
    /// Heading, rad in (-π, π].
    double yaw_rad = 0.0;
    /// One standard deviation of the position as its source states it, m.
    double sigma_m = 0.0;
    /// The receiver's own time, s.
    double receiver_s = 0.0;
    /// Height above the world frame's origin, m; none in version 1 and on the ground.
    std::optional<double> height_m = std::nullopt;
};

/// A reading of the wheels.
struct Odometry {
    /// Time at which it was taken, s.
    double stamp_s = 0.0;
    /// Forward speed, m/s.
    double speed_m_s = 0.0;
    /// Yaw rate, rad/s.
    double yaw_rate_rad_s = 0.0;
    /// Velocity to the left, m/s; none in version 1 and on the ground.
    std::optional<double> left_m_s = std::nullopt;
    /// Velocity up, m/s; none in version 1 and on the ground.
    std::optional<double> up_m_s = std::nullopt;
};

/// An object that perception tracks.
struct Track {
    std::uint32_t id = 0;
    /// `vehicle`, `person`, `decoy` or `other`.
    std::string class_name;
    Place at;
    /// Velocity east and north, m/s.
    Place velocity;
    /// Confidence, 0 to 1.
    double confidence = 0.0;
    /// Time of the last update, s.
    double updated_s = 0.0;
    /// One standard deviation of its place, m; none in version 1.
    std::optional<double> sigma_m = std::nullopt;
};

/// Something that LiDAR shows, without a class.
struct Nearby {
    /// Number, counted apart from those of tracks.
    std::uint32_t id = 0;
    /// Middle of its returns.
    Place at;
    /// Velocity east and north, m/s; zero of a thing that stands.
    Place velocity;
    /// Largest horizontal extent of its returns, m.
    double width_m = 0.0;
};

/// One control step.
struct Step {
    /// Number of the step, from 1.
    std::uint32_t number = 0;
    /// Time of the vehicle's clock, s.
    double time_s = 0.0;
    /// The most that may be driven now, m/s: 0 unless an operator has enabled driving.
    double limit_m_s = 0.0;
    /// Mode of the platform's state machine.
    std::string mode;
    /// The newest position fix; none where there is none, or the guest's file does not take `navigation`.
    std::optional<Fix> fix;
    /// The newest reading of the wheels; none as for `fix`.
    std::optional<Odometry> odometry;
    /// Objects that perception tracks; empty where the guest's file does not take `tracks`.
    std::vector<Track> tracks;
    /// Places that other units claim; empty where the guest's file does not take `teammates`.
    std::vector<Place> teammates;
    /// Height above the ground by the unit's own sensors, m; none in version 1 and on the ground.
    std::optional<double> height_m = std::nullopt;
    /// What LiDAR shows, at most 32; none in version 1, without a product of LiDAR, or where the guest's file does not take
    /// `nearby`.
    std::optional<std::vector<Nearby>> nearby = std::nullopt;
};

/// A velocity in the level frame of the body.
struct Velocity {
    /// Forward, m/s, within ±100.
    double forward_m_s = 0.0;
    /// To the left, m/s, within ±100; 0 on the ground.
    double left_m_s = 0.0;
    /// Up, m/s, within ±100; 0 on the ground.
    double up_m_s = 0.0;
    /// Turn, rad/s, counter-clockwise, within ±10. On the ground it needs a forward speed.
    double turn_rad_s = 0.0;
};

/// A set-point.
struct Reply {
    /// Forward speed, m/s, within ±100.
    double speed_m_s = 0.0;
    /// Curvature, 1/m, positive to the left, within ±10.
    double curvature_per_m = 0.0;
    /// Name of the guest's state: needed where its file gives `state`, refused where not.
    std::optional<std::string> state = std::nullopt;
    /// Place that the guest drives by, m, within ±10,000: needed where its file gives `place`, refused where not.
    std::optional<Place> place = std::nullopt;
    /// Time until the guest wants the next step, s, up to 1; none for the next period.
    std::optional<double> wake_s = std::nullopt;
    /// Velocity in place of speed and curvature, which are then not sent. Refused in version 1.
    std::optional<Velocity> velocity = std::nullopt;
};

/// An autonomy program: told the mission once, then asked for a set-point each step. A start that comes again makes a new one after
/// the destructor of the one before.
struct Guest {
    virtual ~Guest() = default;
    /// Takes the mission. Its limit of time is `start_ms` of the guest's file.
    virtual void start(const Start&) {}
    /// The set-point of a step. Its limit of time is `step_ms` of the guest's file.
    virtual Reply step(const Step&) = 0;
};

namespace detail {

/// Deepest nesting of a line; the protocol needs five.
inline constexpr int MAX_DEPTH = 16;

/// A value of JSON.
struct Value {
    enum class Kind { null, truth, number, text, list, object };
    Kind kind = Kind::null;
    bool truth = false;
    double number = 0.0;
    std::string text;
    /// Of a list, or of an object under `names`.
    std::vector<Value> items;
    std::vector<std::string> names;
};

/// Reads one value of JSON that is the whole text. Memory is a small multiple of the text, recursion at most MAX_DEPTH.
class Reader {
   public:
    explicit Reader(std::string_view text) : text_(text) {}

    Value whole() {
        Value value = read(0);
        space();
        if (at_ != text_.size()) fail("the end of the line");
        return value;
    }

   private:
    std::string_view text_;
    std::size_t at_ = 0;

    [[noreturn]] void fail(const std::string& expected) const {
        throw ProtocolError("a line of JSON expected: " + expected + " expected at byte " + std::to_string(at_ + 1));
    }

    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }

    bool take(char c) {
        if (at_ == text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }

    void space() {
        while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
    }

    Value read(int depth) {
        if (depth > MAX_DEPTH) fail("nesting of at most " + std::to_string(MAX_DEPTH));
        space();
        Value value;
        if (take('{')) {
            value.kind = Value::Kind::object;
            members(value, depth);
        } else if (take('[')) {
            value.kind = Value::Kind::list;
            elements(value, depth);
        } else if (take('"')) {
            value.kind = Value::Kind::text;
            value.text = text();
        } else if (word("true") || word("false")) {
            value.kind = Value::Kind::truth;
            value.truth = text_[at_ - 2] == 'u';
        } else if (!word("null")) {
            value.kind = Value::Kind::number;
            value.number = number();
        }
        return value;
    }

    bool word(std::string_view word) {
        if (text_.substr(at_, word.size()) != word) return false;
        at_ += word.size();
        return true;
    }

    void members(Value& object, int depth) {
        space();
        if (take('}')) return;
        do {
            space();
            if (!take('"')) fail("a name");
            object.names.push_back(text());
            space();
            if (!take(':')) fail("`:`");
            object.items.push_back(read(depth + 1));
            space();
        } while (take(','));
        if (!take('}')) fail("`,` or `}`");
    }

    void elements(Value& list, int depth) {
        space();
        if (take(']')) return;
        do {
            list.items.push_back(read(depth + 1));
            space();
        } while (take(','));
        if (!take(']')) fail("`,` or `]`");
    }

    bool digits() {
        const std::size_t from = at_;
        while (peek() >= '0' && peek() <= '9') ++at_;
        return at_ > from;
    }

    /// A number by JSON's grammar, which is narrower than that of from_chars.
    double number() {
        const std::size_t from = at_;
        take('-');
        const std::size_t first = at_;
        if (!digits()) fail("a value");
        if (text_[first] == '0' && at_ - first > 1) fail("a number without leading zeros");
        if (take('.') && !digits()) fail("a digit");
        if (take('e') || take('E')) {
            if (!take('+')) take('-');
            if (!digits()) fail("a digit");
        }
        double value = 0.0;
        const auto [end, error] = std::from_chars(text_.data() + from, text_.data() + at_, value);
        if (error != std::errc() || end != text_.data() + at_) fail("a number within the range of a double");
        return value;
    }

    /// The rest of a text whose opening quote has been taken, as UTF-8.
    std::string text() {
        std::string out;
        while (!take('"')) {
            if (at_ == text_.size() || static_cast<unsigned char>(text_[at_]) < 0x20) fail("the end of a text");
            const char c = text_[at_++];
            if (c != '\\') {
                out += c;
                continue;
            }
            const char escaped = at_ < text_.size() ? text_[at_++] : '\0';
            const std::size_t plain = std::string_view("\"\\/bfnrt").find(escaped);
            if (escaped == 'u') {
                append(out, code_point());
            } else if (escaped != '\0' && plain != std::string_view::npos) {
                out += "\"\\/\b\f\n\r\t"[plain];
            } else {
                fail("an escape");
            }
        }
        return out;
    }

    std::uint32_t unit() {
        std::uint32_t value = 0;
        const std::string_view hex = text_.substr(at_, 4);
        const auto [end, error] = std::from_chars(hex.data(), hex.data() + hex.size(), value, 16);
        if (hex.size() != 4 || error != std::errc() || end != hex.data() + 4) fail("four hexadecimal digits");
        at_ += 4;
        return value;
    }

    std::uint32_t code_point() {
        const std::uint32_t first = unit();
        if (first < 0xD800 || first > 0xDFFF) return first;
        if (first > 0xDBFF || !word("\\u")) fail("a pair of surrogates");
        const std::uint32_t second = unit();
        if (second < 0xDC00 || second > 0xDFFF) fail("a pair of surrogates");
        return 0x10000 + ((first - 0xD800) << 10) + (second - 0xDC00);
    }

    static void append(std::string& out, std::uint32_t point) {
        const auto byte = [&out](std::uint32_t bits) { out += static_cast<char>(bits); };
        if (point < 0x80) return byte(point);
        if (point < 0x800) {
            byte(0xC0 | point >> 6);
        } else if (point < 0x10000) {
            byte(0xE0 | point >> 12);
            byte(0x80 | (point >> 6 & 0x3F));
        } else {
            byte(0xF0 | point >> 18);
            byte(0x80 | (point >> 12 & 0x3F));
            byte(0x80 | (point >> 6 & 0x3F));
        }
        byte(0x80 | (point & 0x3F));
    }
};

/// A value with its place in the line, for errors.
class Field {
   public:
    Field(const Value& value, std::string at) : value_(value), at_(std::move(at)) {}

    Field operator[](std::string_view name) const {
        const std::optional<Field> field = maybe(name);
        if (!field) throw ProtocolError(at_ + ": the field `" + std::string(name) + "` is missing");
        return *field;
    }

    /// The field of this name, if there is one.
    std::optional<Field> maybe(std::string_view name) const {
        const Value& object = of(Value::Kind::object, "an object");
        for (std::size_t i = 0; i < object.names.size(); ++i) {
            if (object.names[i] == name) return Field(object.items[i], at_ + "." + std::string(name));
        }
        return std::nullopt;
    }

    /// The field of this name by `read`; none where it is absent or null.
    template <class Read>
    auto maybe(std::string_view name, Read read) const {
        std::optional<decltype(read(*this))> out;
        const std::optional<Field> field = maybe(name);
        if (field && !field->null()) out = read(*field);
        return out;
    }

    bool null() const { return value_.kind == Value::Kind::null; }
    double number() const { return of(Value::Kind::number, "a number").number; }
    bool flag() const { return of(Value::Kind::truth, "true or false").truth; }
    const std::string& text() const { return of(Value::Kind::text, "a text").text; }

    std::uint32_t whole() const {
        const double value = number();
        if (value < 0.0 || value > 4294967295.0 || value != std::floor(value)) {
            throw ProtocolError(at_ + ": a whole number of 32 bits expected");
        }
        return static_cast<std::uint32_t>(value);
    }

    Place place(const std::string& expected = "[east, north]") const {
        const Value& list = of(Value::Kind::list, expected);
        if (list.items.size() != 2) throw ProtocolError(at_ + ": " + expected + " expected");
        return {Field(list.items[0], at_).number(), Field(list.items[1], at_).number()};
    }

    template <class Read>
    auto many(Read read) const {
        std::vector<decltype(read(*this))> out;
        const Value& list = of(Value::Kind::list, "a list");
        for (std::size_t i = 0; i < list.items.size(); ++i) {
            out.push_back(read(Field(list.items[i], at_ + "[" + std::to_string(i) + "]")));
        }
        return out;
    }

   private:
    const Value& value_;
    std::string at_;

    const Value& of(Value::Kind kind, const std::string& expected) const {
        if (value_.kind == kind) return value_;
        const char* const names[] = {"null", "a truth value", "a number", "a text", "a list", "an object"};
        throw ProtocolError(at_ + ": " + expected + " expected, got " + names[static_cast<int>(value_.kind)]);
    }
};

inline double number_of(const Field& f) { return f.number(); }
inline Place place_of(const Field& f) { return f.place(); }
inline Disc disc_of(const Field& f) { return {f["at"].place(), f["radius_m"].number()}; }

inline Block block_of(const Field& f) {
    const Place half = f["half_m"].place("[length, width]");
    return {f["at"].place(), half.east, half.north, f["heading_rad"].number()};
}

inline StartPose pose_of(const Field& f) { return {f["at"].place(), f["yaw_rad"].number(), f.maybe("height_m", number_of)}; }

inline Body body_of(const Field& f) {
    const Place size = f["size_m"].place("[length, width]");
    return {f["medium"].text(),
            size.east,
            size.north,
            f["max_curvature_per_m"].number(),
            f["max_reverse_m_s"].number(),
            f["max_climb_m_s"].number(),
            f["cruise_height_m"].number()};
}

inline Origin origin_of(const Field& f) {
    return {f["latitude_deg"].number(), f["longitude_deg"].number(), f["height_m"].number()};
}

/// The version of the protocol, one of PROTOCOLS.
inline std::string protocol_of(const Field& f) {
    const std::string& got = f.text();
    std::string expected;
    for (const std::string_view version : PROTOCOLS) {
        if (got == version) return got;
        if (!expected.empty()) expected += " or ";
        expected += version;
    }
    throw ProtocolError("protocol " + expected + " expected, got " + got.substr(0, 40));
}

inline Start start_of(const Field& f) {
    const std::string protocol = protocol_of(f["protocol"]);
    const std::optional<Field> blocks = f.maybe("blocks");
    return {f["time_s"].number(),
            f["period_s"].number(),
            f["max_speed_m_s"].number(),
            f["braking_m_s2"].number(),
            f["route"].many(place_of),
            f["looped"].flag(),
            f["fence"].many(place_of),
            f["obstacles"].many(disc_of),
            blocks ? blocks->many(block_of) : std::vector<Block>(),
            f.maybe("pose", pose_of),
            f.maybe("body", body_of),
            f.maybe("origin", origin_of),
            protocol};
}

inline Track track_of(const Field& f) {
    return {f["id"].whole(),       f["class"].text(),        f["at"].place(),
            f["velocity"].place(), f["confidence"].number(), f["updated_s"].number(),
            f.maybe("sigma_m", number_of)};
}

inline Nearby nearby_of(const Field& f) {
    return {f["id"].whole(), f["at"].place(), f["velocity"].place(), f["width_m"].number()};
}

inline std::vector<Nearby> all_nearby_of(const Field& f) { return f.many(nearby_of); }

inline std::optional<Fix> fix_of(const Field& f) {
    if (f.null()) return std::nullopt;
    return Fix{f["stamp_s"].number(), f["at"].place(),          f["yaw_rad"].number(),
               f["sigma_m"].number(), f["receiver_s"].number(), f.maybe("height_m", number_of)};
}

inline std::optional<Odometry> odometry_of(const Field& f) {
    if (f.null()) return std::nullopt;
    return Odometry{f["stamp_s"].number(), f["speed_m_s"].number(), f["yaw_rate_rad_s"].number(),
                    f.maybe("left_m_s", number_of), f.maybe("up_m_s", number_of)};
}

inline Step step_of(const Field& f) {
    return {f["number"].whole(),
            f["time_s"].number(),
            f["limit_m_s"].number(),
            f["mode"].text(),
            fix_of(f["fix"]),
            odometry_of(f["odometry"]),
            f["tracks"].many(track_of),
            f["teammates"].many(place_of),
            f.maybe("height_m", number_of),
            f.maybe("nearby", all_nearby_of)};
}

inline double within(const char* name, double got, double most, double least) {
    if (least <= got && got <= most) return got;
    throw std::invalid_argument(std::string(name) + ": " + std::to_string(least) + " to " + std::to_string(most) +
                                " expected, got " + std::to_string(got));
}

/// The shortest decimal that reads back as `value`.
inline std::string decimal(double value) {
    char digits[32];
    const auto [end, error] = std::to_chars(digits, digits + sizeof digits, value);
    return error == std::errc() ? std::string(digits, end) : std::string("null");
}

inline std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
        if (static_cast<unsigned char>(c) < 0x20) {
            const char* const hex = "0123456789abcdef";
            out += "\\u00";
            out += hex[c >> 4];
            out += hex[c & 15];
            continue;
        }
        if (c == '"' || c == '\\') out += '\\';
        out += c;
    }
    return out + '"';
}

/// The answer to step `number`, its end included. Throws std::invalid_argument for a value out of its range.
inline std::string line_of(const Reply& reply, std::uint32_t number) {
    std::string line = "{\"reply\":{\"number\":" + std::to_string(number);
    const double speed = within("speed_m_s", reply.speed_m_s, 100.0, -100.0);
    const double curvature = within("curvature_per_m", reply.curvature_per_m, 10.0, -10.0);
    if (reply.velocity) {
        line += ",\"velocity\":{\"forward_m_s\":" + decimal(within("forward_m_s", reply.velocity->forward_m_s, 100.0, -100.0));
        line += ",\"left_m_s\":" + decimal(within("left_m_s", reply.velocity->left_m_s, 100.0, -100.0));
        line += ",\"up_m_s\":" + decimal(within("up_m_s", reply.velocity->up_m_s, 100.0, -100.0));
        line += ",\"turn_rad_s\":" + decimal(within("turn_rad_s", reply.velocity->turn_rad_s, 10.0, -10.0)) + "}";
    } else {
        line += ",\"speed_m_s\":" + decimal(speed) + ",\"curvature_per_m\":" + decimal(curvature);
    }
    if (reply.state) line += ",\"state\":" + quoted(*reply.state);
    if (reply.place) {
        const double most = 10000.0;
        line += ",\"place\":[" + decimal(within("place east", reply.place->east, most, -most)) + "," +
                decimal(within("place north", reply.place->north, most, -most)) + "]";
    }
    if (reply.wake_s) line += ",\"wake_s\":" + decimal(within("wake_s", *reply.wake_s, 1.0, 0.0));
    return line + "}}\n";
}

/// The next line without its end, of at most MAX_LINE bytes with it. False at the end of the input.
inline bool next_line(std::istream& in, std::string& line) {
    line.clear();
    std::streambuf& buffer = *in.rdbuf();
    for (int c = buffer.sbumpc(); c != std::char_traits<char>::eof(); c = buffer.sbumpc()) {
        if (c == '\n') return true;
        if (line.size() + 1 == MAX_LINE) throw ProtocolError("at most " + std::to_string(MAX_LINE) + " bytes expected, got more");
        line += static_cast<char>(c);
    }
    return !line.empty();
}

/// An output stream's buffer over a descriptor, unbuffered: answers are written whole.
class Descriptor : public std::streambuf {
   public:
    explicit Descriptor(int descriptor) : descriptor_(descriptor) {}

   protected:
    std::streamsize xsputn(const char* from, std::streamsize count) override {
        std::streamsize written = 0;
        while (written < count) {
            const ssize_t now = ::write(descriptor_, from + written, static_cast<std::size_t>(count - written));
            if (now < 0 && errno == EINTR) continue;
            if (now <= 0) break;
            written += now;
        }
        return written;
    }

    int_type overflow(int_type c) override {
        const char byte = traits_type::to_char_type(c);
        return xsputn(&byte, 1) == 1 ? c : traits_type::eof();
    }

   private:
    int descriptor_;
};

}  // namespace detail

/// Answers each line of `requests` with a line to `answers`, with a guest from `make` for each start, until either stream ends.
/// Throws ProtocolError for a request that is no line of the protocol; its message begins with the line's number.
template <class Make>
void serve(Make make, std::istream& requests, std::ostream& answers) {
    std::unique_ptr<Guest> guest;
    std::string line;
    for (std::size_t number = 1; answers; ++number) {
        std::optional<Start> start;
        std::optional<Step> step;
        try {
            if (!detail::next_line(requests, line)) return;
            const detail::Value value = detail::Reader(line).whole();
            if (value.names.size() != 1) throw ProtocolError("an object with one field expected, `start` or `step`");
            const std::string& kind = value.names[0];
            if (kind == "start") {
                start = detail::start_of(detail::Field(value.items[0], kind));
            } else if (kind == "step" && guest) {
                step = detail::step_of(detail::Field(value.items[0], kind));
            } else {
                throw ProtocolError((guest ? "`start` or `step` expected, got `" : "`start` expected, got `") + kind.substr(0, 40) + "`");
            }
        } catch (const ProtocolError& error) {
            throw ProtocolError("line " + std::to_string(number) + ": " + error.what());
        }
        if (start) {
            // A guest may hold a port or a device, which the next one needs.
            guest.reset();
            guest = make();
            guest->start(*start);
            answers << "{\"ready\":{}}\n" << std::flush;
        } else {
            answers << detail::line_of(guest->step(*step), step->number) << std::flush;
        }
    }
}

/// Serves standard input and output, which it takes for itself: whatever else the process prints goes to standard error. The result
/// is the status to end with: 0 at the end of the input, 1 after an exception of the guest's own code, 2 after a request that is no
/// line of the protocol, each with a line on standard error.
template <class Make>
int run(Make make) {
    std::cout << std::flush;
    std::ios::sync_with_stdio(false);
    const int output = ::dup(1);
    ::dup2(2, 1);
    detail::Descriptor buffer(output);
    std::ostream answers(&buffer);
    try {
        serve(std::move(make), std::cin, answers);
        return 0;
    } catch (const ProtocolError& error) {
        std::cerr << "holdsafe_guest: " << error.what() << std::endl;
        return 2;
    } catch (const std::exception& error) {
        std::cerr << "holdsafe_guest: the guest's own error: " << error.what() << std::endl;
        return 1;
    }
}

/// The same with a guest made by its default constructor.
template <class Made>
int run() {
    return run([] { return std::make_unique<Made>(); });
}

}  // namespace holdsafe::guest
