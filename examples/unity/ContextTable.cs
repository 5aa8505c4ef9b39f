// A compiled table of contextdb for C#, by P/Invoke on the exported functions of its header: one library for all tables.
//
// Unity: this file goes into Assets, the library into Assets/Plugins, the compiled tables into StreamingAssets. One character has one
// ContextTable. Nothing is allocated by Query and Pick.
using System;
using System.Collections.Generic;
using System.IO;
using System.Runtime.InteropServices;
using System.Text;

namespace ContextDB
{
    public enum FactType { Bool, Int, Number, Angle, Date, Enum, Text, Tags }

    public sealed class ContextException : Exception
    {
        public ContextException(string message) : base(message) { }
    }

    /// <summary>The facts that a table is asked with: those of a ContextTable, or of one of ContextCharacters.</summary>
    public class ContextFacts
    {
        internal const string Library = "contextdb";
        const int NameBytes = 96;

        [StructLayout(LayoutKind.Sequential)]
        internal struct Fault
        {
            public int Status;
            public IntPtr Reason;
            public int Condition;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = NameBytes)] public byte[] Name;
        }

        [DllImport(Library)] static extern IntPtr cdb_any_condition(IntPtr any, int at, out int type);
        [DllImport(Library)] static extern int cdb_set_missing(IntPtr live, int at);
        [DllImport(Library)] static extern int cdb_set_whole(IntPtr live, int at, long value);
        [DllImport(Library)] static extern int cdb_set_number(IntPtr live, int at, double value);
        [DllImport(Library)] static extern int cdb_set_text(IntPtr live, int at, IntPtr value);
        [DllImport(Library)] static extern int cdb_set_tags(IntPtr live, int at, IntPtr tags, UIntPtr n);

        readonly Dictionary<string, int> places = new Dictionary<string, int>();
        readonly Dictionary<string, FactType> types = new Dictionary<string, FactType>();
        internal IntPtr live;
        IntPtr[] held;

        internal void Take(IntPtr any, IntPtr facts, int n)
        {
            live = facts;
            held = new IntPtr[n];
            for (int at = 0; at < n; at++)
            {
                int type;
                string name = FromUtf8(cdb_any_condition(any, at, out type));
                if (type < 0) continue; // it is computed
                places[name] = at;
                types[name] = (FactType)type;
            }
        }

        /// <summary>The facts that the table asks for, with their types.</summary>
        public IReadOnlyDictionary<string, FactType> Facts { get { return types; } }

        /// <summary>The number of a fact, to set it by: look it up once.</summary>
        public int this[string name]
        {
            get
            {
                int at;
                if (places.TryGetValue(name, out at)) return at;
                throw new ContextException("the table asks for no fact \"" + name + "\"");
            }
        }

        public void Set(int fact, double value) { Require(fact, cdb_set_number(live, fact, value)); }
        public void Set(int fact, long value) { Require(fact, cdb_set_whole(live, fact, value)); }
        public void Set(int fact, bool value) { Require(fact, cdb_set_whole(live, fact, value ? 1 : 0)); }
        public void SetMissing(int fact) { Require(fact, cdb_set_missing(live, fact)); }

        /// <summary>Sets a text, an enum by the name of its value, or a date such as "2026-01-31".</summary>
        public void Set(int fact, string value)
        {
            IntPtr text = ToUtf8(value);
            Hold(fact, cdb_set_text(live, fact, text), text);
        }

        /// <summary>Sets tags by their names.</summary>
        public void Set(int fact, IList<string> tags)
        {
            int size = IntPtr.Size * (tags.Count + 1), length = size;
            foreach (string tag in tags) length += Encoding.UTF8.GetByteCount(tag) + 1;
            IntPtr block = Marshal.AllocHGlobal(length);
            for (int i = 0, at = size; i < tags.Count; i++)
            {
                byte[] octets = Encoding.UTF8.GetBytes(tags[i] + "\0");
                Marshal.Copy(octets, 0, block + at, octets.Length);
                Marshal.WriteIntPtr(block, i * IntPtr.Size, block + at);
                at += octets.Length;
            }
            Hold(fact, cdb_set_tags(live, fact, block, (UIntPtr)(uint)tags.Count), block);
        }

        void Hold(int fact, int status, IntPtr block)
        {
            if (status != 0)
            {
                Marshal.FreeHGlobal(block);
                Require(fact, status);
            }
            if (held[fact] != IntPtr.Zero) Marshal.FreeHGlobal(held[fact]);
            held[fact] = block;
        }

        void Require(int fact, int status)
        {
            if (status == 0) return;
            foreach (var place in places)
                if (place.Value == fact) throw new ContextException(place.Key + ": the fact is not one that the condition can have");
            throw new ContextException("there is no fact number " + fact);
        }

        internal void Free()
        {
            for (int i = 0; held != null && i < held.Length; i++)
            {
                if (held[i] != IntPtr.Zero) Marshal.FreeHGlobal(held[i]);
                held[i] = IntPtr.Zero;
            }
        }

        internal static IntPtr ToUtf8(string text)
        {
            byte[] octets = Encoding.UTF8.GetBytes(text + "\0");
            IntPtr block = Marshal.AllocHGlobal(octets.Length);
            Marshal.Copy(octets, 0, block, octets.Length);
            return block;
        }

        internal static string FromUtf8(IntPtr text)
        {
            if (text == IntPtr.Zero) return null;
            int length = 0;
            while (Marshal.ReadByte(text, length) != 0) length++;
            byte[] octets = new byte[length];
            Marshal.Copy(text, octets, 0, length);
            return Encoding.UTF8.GetString(octets);
        }

        internal static string Text(Fault fault)
        {
            string name = Encoding.UTF8.GetString(fault.Name, 0, Math.Max(0, Array.IndexOf(fault.Name, (byte)0)));
            return (name == "" ? "" : name + ": ") + FromUtf8(fault.Reason);
        }
    }

    public sealed class ContextTable : ContextFacts, IDisposable
    {
        [DllImport(Library)] static extern IntPtr cdb_open_any(IntPtr bytes, UIntPtr size, out Fault fault);
        [DllImport(Library)] static extern void cdb_close_any(IntPtr any);
        [DllImport(Library)] static extern UIntPtr cdb_any_size(IntPtr any, int what);
        [DllImport(Library)] static extern IntPtr cdb_live_of(IntPtr any, int unknown, IntPtr memory);
        [DllImport(Library)] static extern int cdb_live_query(IntPtr live, [Out] ulong[] rows, UIntPtr room, IntPtr fault);
        [DllImport(Library)] static extern int cdb_live_query(IntPtr live, [Out] ulong[] rows, UIntPtr room, out Fault fault);
        [DllImport(Library)] static extern int cdb_live_pick(IntPtr live, ulong[] rows, UIntPtr room, double time, IntPtr picker, out long row, out Fault fault);
        [DllImport(Library)] static extern void cdb_start_picker(IntPtr picker, ulong seed, long who, UIntPtr memory, IntPtr rests, UIntPtr n);
        [DllImport(Library)] static extern IntPtr cdb_asset_of(IntPtr table, long row);
        [DllImport(Library)] static extern int cdb_asset_number(IntPtr table, long row);
        [DllImport(Library)] static extern ulong cdb_digest(IntPtr picker);

        readonly List<IntPtr> blocks = new List<IntPtr>();
        readonly string[] assets;
        readonly ulong[] words;
        IntPtr any, picker;

        /// <summary>Opens a compiled file. Throws ContextException, with the reason, where it is refused.</summary>
        public ContextTable(byte[] file, ulong seed = 0, long who = 0, int memory = 1)
        {
            Fault fault;
            IntPtr bytes = Block(file.Length);
            Marshal.Copy(file, 0, bytes, file.Length);
            any = cdb_open_any(bytes, (UIntPtr)(uint)file.Length, out fault);
            if (any == IntPtr.Zero)
            {
                Dispose();
                throw new ContextException(Text(fault));
            }
            words = new ulong[Size(2)];
            assets = new string[Size(1)];
            for (int row = 0; row < assets.Length; row++) assets[row] = FromUtf8(cdb_asset_of(any, row));
            Take(any, cdb_live_of(any, 0, Block(Size(3))), Size(0));
            picker = Block(Size(4));
            cdb_start_picker(picker, seed, who, (UIntPtr)(uint)memory, Block(Size(5) * 24), (UIntPtr)(uint)Size(5));
        }

        public static ContextTable Open(string path, ulong seed = 0)
        {
            return new ContextTable(File.ReadAllBytes(path), seed);
        }

        /// <summary>The valid rows of the last query, one bit a row: bit r % 64 of word r / 64.</summary>
        public ulong[] Words { get { return words; } }

        /// <summary>Finds the valid rows for the facts as they are: see Words, IsValid and Rows.</summary>
        public void Query()
        {
            if (cdb_live_query(live, words, (UIntPtr)(uint)words.Length, IntPtr.Zero) == 0) return;
            Fault fault;
            cdb_live_query(live, words, (UIntPtr)(uint)words.Length, out fault);
            throw new ContextException(Text(fault));
        }

        /// <summary>One of the valid rows by the table's policy, or -1.</summary>
        public int Pick(double timeS = 0.0)
        {
            long row;
            Fault fault;
            if (cdb_live_pick(live, words, (UIntPtr)(uint)words.Length, timeS, picker, out row, out fault) != 0)
                throw new ContextException(Text(fault));
            return (int)row;
        }

        public bool IsValid(int row) { return (words[row / 64] >> (row % 64) & 1) != 0; }

        public IEnumerable<int> Rows
        {
            get
            {
                for (int row = 0; row < assets.Length; row++)
                    if (IsValid(row)) yield return row;
            }
        }

        /// <summary>The asset of a row; of -1 the table's fallback, or null.</summary>
        public string Asset(int row) { return row < 0 ? FromUtf8(cdb_asset_of(any, -1)) : assets[row]; }

        /// <summary>The number of a row's asset: the place of its clip in an array of yours.</summary>
        public int AssetNumber(int row) { return cdb_asset_number(any, row); }

        /// <summary>Equal on two machines whose characters picked the same.</summary>
        public ulong Digest { get { return cdb_digest(picker); } }

        public void Dispose()
        {
            if (any != IntPtr.Zero) cdb_close_any(any);
            any = IntPtr.Zero;
            foreach (IntPtr block in blocks) Marshal.FreeHGlobal(block);
            blocks.Clear();
            Free();
        }

        int Size(int what) { return (int)cdb_any_size(any, what); }

        /// <summary>Memory that is all 0 and lives as long as the table.</summary>
        IntPtr Block(int size)
        {
            IntPtr block = Marshal.AllocHGlobal(size + 8);
            Marshal.Copy(new byte[size + 8], 0, block, size + 8);
            blocks.Add(block);
            return block;
        }

    }
}
