// A character walks a square, and every pose is written to a file, as numbers of 8 bytes: mono Walk.exe game.motion POSES
using System;
using System.IO;
using ContextDB;

static class Walk
{
    static readonly double[,] Sides = { { 0.0, 1.4 }, { 1.4, 0.0 }, { 0.0, -1.4 }, { -1.4, 0.0 }, { 0.0, 0.0 } };

    static int Main(string[] arguments)
    {
        try
        {
            using (var characters = ContextCharacters.Open(arguments[0], "player"))
            using (var poses = new BinaryWriter(File.Create(arguments[1])))
            {
                double[] root = new double[3], rotations = new double[4 * characters.Joints.Length], positions = new double[3 * characters.Joints.Length];
                ContextFacts facts = characters.Facts(0);
                int gait = facts["gait"];
                facts.Set(facts["style"], "normal");
                for (int tick = 0; tick < 5 * 90; tick++)
                {
                    double x = Sides[tick / 90, 0], z = Sides[tick / 90, 1];
                    characters.Steer(0, x, z);
                    facts.Set(gait, x != 0.0 || z != 0.0 ? "Walk" : "Idle");
                    if (tick == 200) characters.Restore(0, characters.Save(0));
                    characters.Update(1.0 / 60.0);
                    characters.CopyRoot(0, root);
                    characters.CopyRotations(0, rotations);
                    characters.CopyPositions(0, positions);
                    foreach (double[] numbers in new[] { root, rotations, positions })
                        foreach (double number in numbers) poses.Write(number);
                    Console.WriteLine(characters.Asset(0) + "|" + characters.Why(0));
                }
            }
            return 0;
        }
        catch (ContextException refusal)
        {
            Console.Error.WriteLine(refusal.Message);
            return 1;
        }
    }
}
