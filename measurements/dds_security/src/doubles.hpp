// Types of the wire by hand: a record of doubles in CDR. `Twist` has the layout of geometry_msgs/Twist; the odometry is reduced to
// place, speed and a count, so that it matches no ROS 2 node.
#pragma once

#include <array>
#include <cstring>
#include <functional>
#include <string>

#include <fastdds/dds/topic/TopicDataType.hpp>

template <size_t N>
using Doubles = std::array<double, N>;

using Twist = Doubles<6>;
using Odometry = Doubles<6>;

constexpr const char* COMMAND_TOPIC = "rt/cmd_vel";
constexpr const char* ODOMETRY_TOPIC = "rt/odom";
constexpr const char* TWIST_TYPE = "geometry_msgs::msg::dds_::Twist_";
constexpr const char* ODOMETRY_TYPE = "nav_msgs::msg::dds_::Odometry_";

// Four bytes before the content say how it is encoded: CDR, little endian.
constexpr unsigned char ENCAPSULATION[4] = {0, 1, 0, 0};

template <size_t N>
class DoublesType : public eprosima::fastdds::dds::TopicDataType {
    using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
    using Handle = eprosima::fastrtps::rtps::InstanceHandle_t;

public:
    static constexpr uint32_t LENGTH = sizeof ENCAPSULATION + sizeof(Doubles<N>);

    explicit DoublesType(const std::string& name) {
        setName(name.c_str());
        m_typeSize = LENGTH;
        m_isGetKeyDefined = false;
    }

    bool serialize(void* data, Payload* payload) override {
        std::memcpy(payload->data, ENCAPSULATION, sizeof ENCAPSULATION);
        std::memcpy(payload->data + sizeof ENCAPSULATION, data, sizeof(Doubles<N>));
        payload->length = LENGTH;
        payload->encapsulation = CDR_LE;
        return true;
    }

    bool deserialize(Payload* payload, void* data) override {
        const bool is_whole = payload->length >= LENGTH;
        if (!is_whole || std::memcmp(payload->data, ENCAPSULATION, 2) != 0) return false;
        std::memcpy(data, payload->data + sizeof ENCAPSULATION, sizeof(Doubles<N>));
        return true;
    }

    std::function<uint32_t()> getSerializedSizeProvider(void*) override {
        return [] { return LENGTH; };
    }

    void* createData() override { return new Doubles<N>(); }
    void deleteData(void* data) override { delete static_cast<Doubles<N>*>(data); }
    bool getKey(void*, Handle*, bool) override { return false; }
};
