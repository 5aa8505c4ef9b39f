// The characters of a bundle of contextdb for C#, by P/Invoke: all of them in one call.
//
// Unity: this file goes into Assets beside ContextTable.cs, game.motion into StreamingAssets. Nothing is allocated by Update.
using System;
using System.IO;
using System.Runtime.InteropServices;

namespace ContextDB
{
    public sealed class ContextCharacters : IDisposable
    {
        const string Library = ContextFacts.Library;

        [DllImport(Library)] static extern IntPtr cdbm_open_crowd(IntPtr bytes, UIntPtr size, byte[] controller, UIntPtr n, int unknown, out IntPtr why);
        [DllImport(Library)] static extern void cdbm_close_crowd(IntPtr crowd);
        [DllImport(Library)] static extern UIntPtr cdbm_crowd_size(IntPtr crowd, int what);
        [DllImport(Library)] static extern int cdbm_crowd_parent(IntPtr crowd, UIntPtr joint);
        [DllImport(Library)] static extern IntPtr cdbm_crowd_table(IntPtr crowd, UIntPtr table);
        [DllImport(Library)] static extern IntPtr cdbm_crowd_live(IntPtr crowd, UIntPtr i, UIntPtr table);
        [DllImport(Library)] static extern int cdbm_place_one(IntPtr crowd, UIntPtr i, double x, double z, double heading);
        [DllImport(Library)] static extern int cdbm_steer_one(IntPtr crowd, UIntPtr i, double x, double z, double facing);
        [DllImport(Library)] static extern int cdbm_restore_one(IntPtr crowd, UIntPtr i, IntPtr state);
        [DllImport(Library)] static extern IntPtr cdbm_update_crowd(IntPtr crowd, double dt, IntPtr fault);
        [DllImport(Library)] static extern IntPtr cdbm_crowd_numbers(IntPtr crowd, UIntPtr i, int what);
        [DllImport(Library)] static extern IntPtr cdbm_crowd_text(IntPtr crowd, UIntPtr i, int what);
        [DllImport(Library)] static extern UIntPtr cdb_any_size(IntPtr any, int what);

        readonly IntPtr memory, fault;
        readonly ContextFacts[] facts;
        readonly int tables, stateBytes;
        IntPtr crowd;

        /// <summary>The names of the joints, and the joint that moves each, -1 for the root.</summary>
        public readonly string[] Joints;
        public readonly int[] Parents;

        /// <summary>Opens a bundle for some characters of [controllers.CONTROLLER]. Throws ContextException, with the reason, where it is refused.</summary>
        public ContextCharacters(byte[] file, string controller, int count)
        {
            IntPtr why;
            memory = Marshal.AllocHGlobal(file.Length + 16);
            IntPtr bytes = new IntPtr((memory.ToInt64() + 15) & ~15L);
            Marshal.Copy(file, 0, bytes, file.Length);
            fault = Marshal.AllocHGlobal(Marshal.SizeOf(typeof(ContextFacts.Fault)));
            byte[] name = System.Text.Encoding.UTF8.GetBytes(controller + "\0");
            crowd = cdbm_open_crowd(bytes, (UIntPtr)(uint)file.Length, name, (UIntPtr)(uint)Math.Max(0, count), 0, out why);
            if (crowd == IntPtr.Zero)
            {
                Dispose();
                throw new ContextException(ContextFacts.FromUtf8(why));
            }
            Joints = new string[Size(1)];
            Parents = new int[Joints.Length];
            for (int joint = 0; joint < Joints.Length; joint++)
            {
                Joints[joint] = Text(joint, 12);
                Parents[joint] = cdbm_crowd_parent(crowd, (UIntPtr)(uint)joint);
            }
            tables = Size(2);
            stateBytes = Size(3);
            facts = new ContextFacts[count * tables];
            for (int at = 0; at < facts.Length; at++)
            {
                IntPtr any = cdbm_crowd_table(crowd, (UIntPtr)(uint)(at % tables));
                facts[at] = new ContextFacts();
                facts[at].Take(any, cdbm_crowd_live(crowd, (UIntPtr)(uint)(at / tables), (UIntPtr)(uint)(at % tables)), (int)cdb_any_size(any, 0));
            }
        }

        public static ContextCharacters Open(string path, string controller, int count = 1)
        {
            return new ContextCharacters(File.ReadAllBytes(path), controller, count);
        }

        /// <summary>The facts of a character for a table of the bundle.</summary>
        public ContextFacts Facts(int character, int table = 0) { return facts[character * tables + table]; }

        /// <summary>Puts a character somewhere, with nothing played yet; the heading in radians.</summary>
        public void Place(int character, double x, double z, double heading) { Require(cdbm_place_one(crowd, (UIntPtr)(uint)character, x, z, heading)); }

        /// <summary>The velocity that its stick asks for, m/s, and where it is to face: NaN for where it goes.</summary>
        public void Steer(int character, double x, double z, double facing = double.NaN) { Require(cdbm_steer_one(crowd, (UIntPtr)(uint)character, x, z, facing)); }

        /// <summary>Updates all. Throws ContextException, and all stand where they stood, where a fact is refused or a number is none.</summary>
        public void Update(double seconds)
        {
            IntPtr why = cdbm_update_crowd(crowd, seconds, fault);
            if (why == IntPtr.Zero) return;
            var own = (ContextFacts.Fault)Marshal.PtrToStructure(fault, typeof(ContextFacts.Fault));
            throw new ContextException(own.Reason == IntPtr.Zero ? ContextFacts.FromUtf8(why) : ContextFacts.Text(own));
        }

        /// <summary>What plays; "" for nothing.</summary>
        public string Asset(int character) { return Text(character, 9); }

        /// <summary>What it did in the last update, and why.</summary>
        public string Why(int character) { return Text(character, 10) + ": " + Text(character, 11); }

        /// <summary>x, z and heading of the pose.</summary>
        public void CopyRoot(int character, double[] to) { Copy(character, 4, to, 3); }

        /// <summary>Of each joint w, x, y and z against its parent.</summary>
        public void CopyRotations(int character, double[] to) { Copy(character, 5, to, 4 * Joints.Length); }

        /// <summary>Of each joint x, y and z in the world.</summary>
        public void CopyPositions(int character, double[] to) { Copy(character, 7, to, 3 * Joints.Length); }

        /// <summary>All that the future of a character depends on beside what it is given then: keep it to come back to it.</summary>
        public byte[] Save(int character)
        {
            var state = new byte[stateBytes];
            Marshal.Copy(Numbers(character, 8), state, 0, stateBytes);
            return state;
        }

        /// <summary>Goes on from what Save gave, of this bundle.</summary>
        public void Restore(int character, byte[] state)
        {
            if (state.Length != stateBytes) throw new ContextException("this is no state of such a character");
            IntPtr block = Marshal.AllocHGlobal(stateBytes);
            Marshal.Copy(state, 0, block, stateBytes);
            int isDone = cdbm_restore_one(crowd, (UIntPtr)(uint)character, block);
            Marshal.FreeHGlobal(block);
            if (isDone == 0) throw new ContextException("this is no state of such a character");
        }

        public void Dispose()
        {
            for (int at = 0; facts != null && at < facts.Length; at++) facts[at].Free();
            if (crowd != IntPtr.Zero) cdbm_close_crowd(crowd);
            crowd = IntPtr.Zero;
            Marshal.FreeHGlobal(fault);
            Marshal.FreeHGlobal(memory);
        }

        int Size(int what) { return (int)cdbm_crowd_size(crowd, what); }

        string Text(int number, int what) { return ContextFacts.FromUtf8(cdbm_crowd_text(crowd, (UIntPtr)(uint)number, what)); }

        IntPtr Numbers(int character, int what)
        {
            IntPtr numbers = cdbm_crowd_numbers(crowd, (UIntPtr)(uint)character, what);
            Require(numbers != IntPtr.Zero ? 1 : 0);
            return numbers;
        }

        void Copy(int character, int what, double[] to, int n) { Marshal.Copy(Numbers(character, what), to, 0, n); }

        static void Require(int isThere)
        {
            if (isThere == 0) throw new ContextException("there is no character of that number");
        }
    }
}
