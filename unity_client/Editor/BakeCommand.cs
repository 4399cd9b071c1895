using System;
using System.Diagnostics;
using System.Text;

namespace HapticVLM.Editor
{
    /// <summary>Runs `hapticvlm bake` beside the editor. Never blocks.</summary>
    internal sealed class BakeCommand
    {
        readonly Process process;
        readonly StringBuilder output = new StringBuilder();

        /// <summary>Starts the program at this path or of this name. Throws if there is none.</summary>
        public BakeCommand(string program, string scene, string folder)
        {
            process = new Process
            {
                StartInfo = new ProcessStartInfo(program, Arguments(scene, folder))
                {
                    UseShellExecute = false,
                    CreateNoWindow = true,
                    RedirectStandardOutput = true,
                    RedirectStandardError = true,
                },
            };
            process.OutputDataReceived += Add;
            process.ErrorDataReceived += Add;
            process.Start();
            process.BeginOutputReadLine();
            process.BeginErrorReadLine();
        }

        public bool IsDone { get { return process.HasExited; } }

        /// <summary>Whether it wrote the bake; waits for its last lines.</summary>
        public bool IsGood
        {
            get
            {
                process.WaitForExit();
                return process.ExitCode == 0;
            }
        }

        public string Output { get { lock (output) return output.ToString().Trim(); } }

        /// <summary>The command as a person types it.</summary>
        public static string Text(string program, string scene, string folder)
        {
            return (program.IndexOf(' ') < 0 ? program : "\"" + program + "\"") + " " + Arguments(scene, folder);
        }

        public void End()
        {
            try
            {
                if (!process.HasExited) process.Kill();
            }
            catch (InvalidOperationException)
            {
                // It ended meanwhile.
            }
        }

        static string Arguments(string scene, string folder)
        {
            return "bake \"" + scene + "\" -o \"" + folder + "\"";
        }

        void Add(object sender, DataReceivedEventArgs line)
        {
            if (line.Data == null) return;
            lock (output) output.AppendLine(line.Data);
        }
    }
}
