// A shared object to load before Fast DDS: the two checks of one's own rights to a topic always succeed. With it an insider's library
// makes a writer or a reader that its permissions deny; the checks of the other participants are not touched.
#define PREFIX "_ZN8eprosima8fastrtps4rtps8security11Permissions23"
#define ARGUMENTS "ERKNS2_6HandleEjRKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEERKSt6vectorISC_SaISC_EERNS2_17SecurityExceptionE"

extern "C" {
bool unchecked_writer() asm(PREFIX "check_create_datawriter" ARGUMENTS);
bool unchecked_reader() asm(PREFIX "check_create_datareader" ARGUMENTS);

bool unchecked_writer() { return true; }
bool unchecked_reader() { return true; }
}
