// A character walks a square, without Unreal: Walk game.motion POSES JOINTS. The numbers of the core go into one file, and the joints in
// Unreal's axes into another, each number in 8 bytes.
#define CDB_FILES // for cdb_read_file
#include "ContextCrowd.h"

#include <cstdio>

static void Write(std::FILE* File, const double* Numbers, std::size_t Count)
{
    std::fwrite(Numbers, sizeof(double), Count, File);
}

int main(int Count, char** Words)
{
    static const double Sides[5][2] = {{140.0, 0.0}, {0.0, -140.0}, {-140.0, 0.0}, {0.0, 140.0}, {0.0, 0.0}};
    contextdb::FCrowd Crowd;
    std::vector<contextdb::FJoint> Joints;
    cdb_fault Fault;
    std::size_t Size = 0;
    if (Count != 4) return 2;
    void* Bytes = cdb_read_file(Words[1], &Size, &Fault);
    const char* Why = Bytes ? Crowd.Open(Bytes, Size, "player", 1) : Fault.reason;
    CDB_FREE(Bytes);
    if (Why) return std::fprintf(stderr, "%s\n", Why), 1;
    std::FILE *Poses = std::fopen(Words[2], "wb"), *InUnreal = std::fopen(Words[3], "wb");
    if (!Poses || !InUnreal || Crowd.SetFact(0, "no such", 1.0) || !Crowd.SetFact(0, "style", "normal")) return 3;
    if (Crowd.Expect(0, "no such", 1.0) || !Crowd.Expect(0, "Contact.Left", 1.0) || !Crowd.Expect(0, nullptr, 0.0)) return 4;
    const std::size_t NumJoints = Crowd.Num(CDBM_N_JOINTS);
    for (int Tick = 0; Tick < 5 * 90; Tick++)
    {
        const double* Side = Sides[Tick / 90];
        double Root[3];
        Crowd.Steer(0, Side[0], Side[1]);
        Crowd.SetFact(0, "gait", Side[0] != 0.0 || Side[1] != 0.0 ? "Walk" : "Idle");
        Why = Crowd.Update(1.0 / 60.0);
        if (Why) return std::fprintf(stderr, "%s\n", Why), 1;
        Write(Poses, Crowd.Numbers(0, CDBM_ROOT_NUMBERS), 3);
        Write(Poses, Crowd.Numbers(0, CDBM_ROTATION_NUMBERS), 4 * NumJoints);
        Write(Poses, Crowd.Numbers(0, CDBM_POSITION_NUMBERS), 3 * NumJoints);
        Crowd.Root(0, Root[0], Root[1], Root[2]);
        Crowd.Joints(0, Joints);
        Write(InUnreal, Root, 3);
        Write(InUnreal, Joints[0].X, 12 * NumJoints);
        std::printf("%s|%s\n", Crowd.Asset(0), Crowd.Why(0).c_str());
    }
    std::fclose(Poses), std::fclose(InUnreal);
    return 0;
}
