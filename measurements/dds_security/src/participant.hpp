// A participant on the loopback interface alone, plain or with the files of a folder of credentials, and its endpoints.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "doubles.hpp"
#include "report.hpp"

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

// Reports whom the library authenticates and whom it refuses.
class Authentications : public fast::DomainParticipantListener {
    void onParticipantAuthentication(fast::DomainParticipant*, rtps::ParticipantAuthenticationInfo&& info) override {
        const bool is_authorised = info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT;
        report(is_authorised ? "authorised" : "unauthorised", "\"guid\": \"%s\"", text(info.guid).c_str());
    }
};

inline void use_loopback(fast::DomainParticipantQos& qos) {
    auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList = {"127.0.0.1"};
    transport->maxInitialPeersRange = 8;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    rtps::Locator_t peer;
    rtps::IPLocator::setIPv4(peer, "127.0.0.1");
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
}

// Announcements in the first second are frequent, so that a match does not wait for a period of three seconds.
inline void announce_often(fast::DomainParticipantQos& qos) {
    auto& discovery = qos.wire_protocol().builtin.discovery_config;
    discovery.initial_announcements.count = 40;
    discovery.initial_announcements.period = {0, 25'000'000};
    discovery.leaseDuration_announcementperiod = {0, 200'000'000};
}

inline void secure(fast::DomainParticipantQos& qos, const std::string& folder) {
    const auto set = [&](const std::string& name, const std::string& value) {
        qos.properties().properties().emplace_back("dds.sec." + name, value);
    };
    const auto file = [&](const std::string& name, const char* file) { set(name, "file://" + folder + "/" + file); };
    set("auth.plugin", "builtin.PKI-DH");
    file("auth.builtin.PKI-DH.identity_ca", "identity_ca.pem");
    file("auth.builtin.PKI-DH.identity_certificate", "certificate.pem");
    file("auth.builtin.PKI-DH.private_key", "key.pem");
    set("access.plugin", "builtin.Access-Permissions");
    file("access.builtin.Access-Permissions.permissions_ca", "permissions_ca.pem");
    file("access.builtin.Access-Permissions.governance", "governance.smime");
    file("access.builtin.Access-Permissions.permissions", "permissions.smime");
    set("crypto.plugin", "builtin.AES-GCM-GMAC");
}

// A null pointer where the library refuses the participant. An empty folder is a plain participant.
inline fast::DomainParticipant* make_participant(unsigned domain, const std::string& folder) {
    static Authentications listener;
    fast::DomainParticipantQos qos;
    use_loopback(qos);
    announce_often(qos);
    if (!folder.empty()) secure(qos, folder);
    auto* made = fast::DomainParticipantFactory::get_instance()->create_participant(domain, qos, &listener, fast::StatusMask::none());
    report("participant", "\"guid\": \"%s\"", made ? text(made->guid()).c_str() : "");
    return made;
}

inline fast::Topic* make_topic(fast::DomainParticipant* participant, const std::string& name) {
    const std::string type = name == COMMAND_TOPIC ? TWIST_TYPE : ODOMETRY_TYPE;
    fast::TypeSupport(new DoublesType<6>(type)).register_type(participant);
    return participant->create_topic(name, type, fast::TOPIC_QOS_DEFAULT);
}

// A writer as ROS 2 makes it by default: reliable, volatile, the last ten. A null pointer where the library refuses it.
inline fast::DataWriter* make_writer(fast::DomainParticipant* participant, fast::Topic* topic, fast::DataWriterListener* listener) {
    fast::DataWriterQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;
    qos.data_sharing().off();
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* made = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos, listener);
    report("writer", "\"topic\": \"%s\", \"guid\": \"%s\"", topic->get_name().c_str(), made ? text(made->guid()).c_str() : "");
    return made;
}

inline fast::DataReader* make_reader(fast::DomainParticipant* participant, fast::Topic* topic, bool is_reliable,
                                    fast::DataReaderListener* listener) {
    fast::DataReaderQos qos;
    qos.reliability().kind = is_reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
    qos.history().depth = 10;
    qos.data_sharing().off();
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* made = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, qos, listener);
    report("reader", "\"topic\": \"%s\", \"guid\": \"%s\"", topic->get_name().c_str(), made ? text(made->guid()).c_str() : "");
    return made;
}
