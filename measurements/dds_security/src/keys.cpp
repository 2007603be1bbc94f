// A shared object to load before Fast DDS: prints the keys that the other participants hand to this one after the handshake, as a reader
// with valid rights gets them. What such a reader can do with them is the question of the attack `reader-forges`.
#include <cstdio>
#include <vector>

#include <dlfcn.h>

#include <fastdds/rtps/common/Token.h>

#define PREFIX "_ZN8eprosima8fastrtps4rtps8security22AESGCMGMAC_KeyExchange"
#define WRITER PREFIX "35set_remote_datawriter_crypto_tokensERNS2_6HandleES5_RKSt6vectorINS1_10DataHolderESaIS7_EERNS2_17SecurityExceptionE"
#define PARTICIPANT PREFIX "36set_remote_participant_crypto_tokensERKNS2_6HandleERS4_RKSt6vectorINS1_10DataHolderESaIS9_EERNS2_17SecurityExceptionE"

using eprosima::fastrtps::rtps::DataHolderSeq;
using Set = bool (*)(void*, void*, void*, const DataHolderSeq&, void*);

static void print(const char* of, const DataHolderSeq& tokens) {
    for (const auto& token : tokens) {
        for (const auto& property : token.binary_properties()) {
            std::fprintf(stderr, "key %s ", of);
            for (unsigned char byte : property.value()) std::fprintf(stderr, "%02x", byte);
            std::fprintf(stderr, "\n");
        }
    }
}

static bool call(const char* name, void* self, void* own, void* remote, const DataHolderSeq& tokens, void* error) {
    return reinterpret_cast<Set>(dlsym(RTLD_NEXT, name))(self, own, remote, tokens, error);
}

extern "C" {
bool writer_keys(void* self, void* own, void* remote, const DataHolderSeq& tokens, void* error) asm(WRITER);
bool participant_keys(void* self, void* own, void* remote, const DataHolderSeq& tokens, void* error) asm(PARTICIPANT);

bool writer_keys(void* self, void* own, void* remote, const DataHolderSeq& tokens, void* error) {
    print("writer", tokens);
    return call(WRITER, self, own, remote, tokens, error);
}

bool participant_keys(void* self, void* own, void* remote, const DataHolderSeq& tokens, void* error) {
    print("participant", tokens);
    return call(PARTICIPANT, self, own, remote, tokens, error);
}
}
