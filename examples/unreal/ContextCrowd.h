// The characters of a bundle of contextdb in Unreal's axes, in C++17 and without Unreal: what the component beside this file does is here.
//
// contextdb has x to the left, y up and z ahead, in metres, and headings that grow to the left; Unreal X ahead, Y to the right and Z up, in
// centimetres, and yaws that grow to the right.
#pragma once

#include "contextdb_motion.h"

#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace contextdb
{
/** Where a joint is in the world: its axes, of length 1, and its place. */
struct FJoint
{
    double X[3], Y[3], Z[3], Origin[3];
};

/** Three numbers of contextdb in Unreal's axes. */
template <typename TNumber>
void ToUnreal(const TNumber* From, double Scale, double* To)
{
    To[0] = Scale * static_cast<double>(From[2]);
    To[1] = -Scale * static_cast<double>(From[0]);
    To[2] = Scale * static_cast<double>(From[1]);
}

inline double YawOf(double Heading)
{
    return -180.0 / CDBO_PI * Heading;
}

class FCrowd
{
public:
    /** Open a bundle for some characters of [controllers.NAME]: nullptr, or why it is refused. The bytes are copied. */
    const char* Open(const void* Bytes, std::size_t Size, const char* Controller, std::size_t Count)
    {
        const char* Why = nullptr;
        Crowd.reset();
        Bundle.resize(Size / sizeof(FBlock) + 1);
        std::memcpy(Bundle.data(), Bytes, Size);
        Crowd.reset(cdbm_open_crowd(Bundle.data(), Size, Controller, Count, CDB_UNKNOWN_ERROR, &Why));
        Matrices.resize(Crowd ? 16 * Num(CDBM_N_JOINTS) : 0);
        return Crowd ? nullptr : Why;
    }

    bool IsOpen() const { return Crowd != nullptr; }

    /** How many there are of something, such as CDBM_N_JOINTS. */
    std::size_t Num(cdbm_crowd_what What) const { return Crowd ? cdbm_crowd_size(Crowd.get(), What) : 0; }

    const char* JointName(std::size_t Joint) const { return cdbm_crowd_text(Crowd.get(), Joint, CDBM_JOINT_TEXT); }

    int Parent(std::size_t Joint) const { return cdbm_crowd_parent(Crowd.get(), Joint); }

    /** Put a character somewhere, in centimetres and degrees, with nothing played yet. */
    void Place(std::size_t Character, double X, double Y, double Yaw)
    {
        cdbm_place_one(Crowd.get(), Character, 0.0 - Y / 100.0, X / 100.0, -CDBO_PI / 180.0 * Yaw);
    }

    /** The velocity over the ground that its stick asks for, cm/s; it faces where it goes. */
    void Steer(std::size_t Character, double X, double Y)
    {
        cdbm_steer_one(Crowd.get(), Character, 0.0 - Y / 100.0, X / 100.0, static_cast<double>(NAN));
    }

    /** What is to happen in so many seconds, such as "Contact.Left": to be set before each update until then, and nullptr behind it. The
     * text stays where it is. False where no database has such an event. */
    bool Expect(std::size_t Character, const char* Event, double Seconds)
    {
        return cdbm_event_one(Crowd.get(), Character, Event, Seconds) != 0;
    }

    /** Set a fact in each table of the bundle that asks for it: a text, such as "Walk", or a number. False where none takes it. */
    bool SetFact(std::size_t Character, const char* Fact, const char* Value)
    {
        const char* Kept = Texts.insert(Value).first->c_str(); // a live context copies no text
        return SetIn(Character, Fact, [Kept](cdb_live* Live, int At) { return cdb_set_text(Live, At, Kept); });
    }

    bool SetFact(std::size_t Character, const char* Fact, double Value)
    {
        return SetIn(Character, Fact, [Value](cdb_live* Live, int At) { return cdb_set_number(Live, At, Value); });
    }

    /** Play an animation of a database to a place, in centimetres and degrees, from the next update on: the one that costs least for the
     * pose and the way, where that is at most MostCost. False where none plays. */
    bool Enter(std::size_t Character, const char* Database, double X, double Y, double Yaw, double MostCost)
    {
        return cdbm_enter_one(Crowd.get(), Character, Database, 0.0 - Y / 100.0, X / 100.0, -CDBO_PI / 180.0 * Yaw, MostCost) <= MostCost;
    }

    /** Let some characters play a clip of several roles together from the next update on, of joint databases by their name: the clip, frame
     * and cast that cost least, where that is at most MostCost. False where none plays. */
    bool Meet(const char* Joint, const std::vector<std::size_t>& Characters, double MostCost)
    {
        return cdbm_meet_ones(Crowd.get(), Joint, Characters.data(), Characters.size(), MostCost) <= MostCost;
    }

    /** Update all: nullptr, or what was wrong; all then stand where they stood. */
    const char* Update(double Seconds) { return cdbm_update_crowd(Crowd.get(), Seconds, nullptr); }

    /** What plays; "" for nothing. */
    const char* Asset(std::size_t Character) const { return cdbm_crowd_text(Crowd.get(), Character, CDBM_ASSET_TEXT); }

    /** What it did in the last update, and why. */
    std::string Why(std::size_t Character) const
    {
        return std::string(cdbm_crowd_text(Crowd.get(), Character, CDBM_ACTION_TEXT)) + ": "
            + cdbm_crowd_text(Crowd.get(), Character, CDBM_REASON_TEXT);
    }

    /** Where a character is on the ground, in centimetres, and its yaw in degrees. */
    void Root(std::size_t Character, double& X, double& Y, double& Yaw) const
    {
        const double* Root = cdbm_crowd_numbers(Crowd.get(), Character, CDBM_ROOT_NUMBERS);
        X = 100.0 * Root[1], Y = -100.0 * Root[0], Yaw = YawOf(Root[2]);
    }

    /** All joints of a character in the world. */
    void Joints(std::size_t Character, std::vector<FJoint>& To)
    {
        To.resize(Num(CDBM_N_JOINTS));
        cdbm_matrices(&Crowd->player, &Crowd->poses[Character], Matrices.data());
        for (std::size_t Joint = 0; Joint < To.size(); Joint++)
        {
            const float* Columns = &Matrices[16 * Joint]; // the axes of contextdb, then the place
            ToUnreal(Columns + 8, 1.0, To[Joint].X);
            ToUnreal(Columns, -1.0, To[Joint].Y);
            ToUnreal(Columns + 4, 1.0, To[Joint].Z);
            ToUnreal(Columns + 12, 100.0, To[Joint].Origin);
        }
    }

    /** The numbers of a character as the core has them, such as CDBM_ROTATION_NUMBERS. */
    const double* Numbers(std::size_t Character, cdbm_crowd_what What) const { return cdbm_crowd_numbers(Crowd.get(), Character, What); }

private:
    struct alignas(16) FBlock
    {
        unsigned char Bytes[16];
    };

    struct FClose
    {
        void operator()(cdbm_crowd* Open) const { cdbm_close_crowd(Open); }
    };

    template <typename TSet>
    bool SetIn(std::size_t Character, const char* Fact, TSet Set)
    {
        bool IsSet = false;
        for (std::size_t Table = 0; Table < Num(CDBM_N_TABLES); Table++)
        {
            const int At = cdb_condition_number(&cdbm_crowd_table(Crowd.get(), Table)->schema, Fact);
            cdb_live* Live = cdbm_crowd_live(Crowd.get(), Character, Table);
            if (At >= 0 && Live && Set(Live, At) == CDB_OK) IsSet = true;
        }
        return IsSet;
    }

    std::vector<FBlock> Bundle; // outlives the characters
    std::unique_ptr<cdbm_crowd, FClose> Crowd;
    std::vector<float> Matrices;
    std::set<std::string> Texts;
};
} // namespace contextdb
