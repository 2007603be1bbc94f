// Listeners that report each match and each delivered message: the witness of a run.
#pragma once

#include <mutex>

#include "participant.hpp"

// Reports every message by its writer, its sequence number and its bytes, and keeps the first number of the last one.
class Witness : public fast::DataReaderListener {
public:
    explicit Witness(std::string topic) : topic_(std::move(topic)) {}

    void on_data_available(fast::DataReader* reader) override {
        Doubles<6> content{};
        fast::SampleInfo info;
        while (reader->take_next_sample(&content, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            last_ = content[0];
            last_time_ = now();
            const rtps::GUID_t writer = info.sample_identity.writer_guid();
            const auto number = info.sample_identity.sequence_number().to64long();
            report("received", "\"topic\": \"%s\", \"guid\": \"%s\", \"number\": %lld, \"bytes\": \"%s\"", topic_.c_str(),
                   text(writer).c_str(), static_cast<long long>(number), hexadecimal(&content, sizeof content).c_str());
        }
    }

    void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
        rtps::GUID_t writer;
        rtps::iHandle2GUID(writer, status.last_publication_handle);
        report("matched", "\"topic\": \"%s\", \"guid\": \"%s\", \"change\": %d", topic_.c_str(), text(writer).c_str(),
               status.current_count_change);
        matches_ = status.current_count;
    }

    // The first number of the last message, 0 before one, or if `patience` is above 0 and the last one is older than that.
    double last(double patience) const { return patience > 0 && now() - last_time_ > patience ? 0.0 : last_.load(); }
    bool is_matched() const { return matches_ > 0; }

private:
    std::string topic_;
    std::atomic<double> last_{0.0};
    std::atomic<double> last_time_{0.0};
    std::atomic<int> matches_{0};
};

// Reports the readers that a writer is matched with.
class Audience : public fast::DataWriterListener {
public:
    void on_publication_matched(fast::DataWriter* writer, const fast::PublicationMatchedStatus& status) override {
        rtps::GUID_t reader;
        rtps::iHandle2GUID(reader, status.last_subscription_handle);
        report("audience", "\"topic\": \"%s\", \"guid\": \"%s\", \"change\": %d", writer->get_topic()->get_name().c_str(),
               text(reader).c_str(), status.current_count_change);
        matches_ = status.current_count;
    }
    bool is_matched() const { return matches_ > 0; }

private:
    std::atomic<int> matches_{0};
};

// Writes, and reports the bytes that were handed to the library.
inline void write(fast::DataWriter* writer, Doubles<6>& content) {
    const bool is_taken = writer->write(&content);
    report("sent", "\"topic\": \"%s\", \"taken\": %s, \"bytes\": \"%s\"", writer->get_topic()->get_name().c_str(),
           is_taken ? "true" : "false", hexadecimal(&content, sizeof content).c_str());
}
